#include "loops.h"

#include <math.h>

enum { LATELY_ROWS = 10 }; /* hypotheses need not feel a thing in the same row */

/* A closure is of the likeliest hypothesis. Each of the others counts as much as that: their evidence, a sum over many
 * readings, is surer than it should be. */
static bool loops_sure(const struct nav_loops *l, int agree, struct nav_closure *c)
{
    c->doubt = 1.0 - (1.0 - c->doubt) * agree / l->maps;
    return c->doubt < NAV_CLOSURE_FALSE;
}

/* Whether it is the same thing again in another hypothesis: met now, and last at the same row. */
static bool loops_same(const struct nav_closure *c, const struct nav_sighting *then, const struct nav_sighting *last)
{
    return then->row == c->then.row && last->row >= c->now.row - LATELY_ROWS;
}

/* How many hypotheses have the closure of a face; said: it is not to be said again by them. */
static int loops_of_face(const struct nav_loops *l, const struct nav_closure *c, bool said)
{
    int agree = 0;
    for (int n = 0; n < l->maps; n++) {
        struct nav_faces *f = &l->map[n].faces;
        bool same = false;
        for (int k = 0; k < f->count; k++) {
            struct nav_stretch *s = &f->face[k].stretch;
            if (!loops_same(c, &s->then, &s->last))
                continue;
            same = true;
            s->open &= !said;
        }
        agree += same;
    }
    return agree;
}

static int loops_of_corner(const struct nav_loops *l, const struct nav_closure *c, bool said)
{
    int agree = 0;
    for (int n = 0; n < l->maps; n++) {
        struct nav_corners *corners = &l->map[n].faces.corners;
        bool same = false;
        for (int k = 0; k < corners->count; k++) {
            struct nav_corner_felt *felt = &corners->felt[k];
            if (!loops_same(c, &felt->then, &felt->last))
                continue;
            same = true;
            felt->open &= !said;
        }
        agree += same;
    }
    return agree;
}

/* How many hypotheses have the robot on the same tile. */
static int loops_of_tile(const struct nav_loops *l, const struct nav_closure *c)
{
    int agree = 0, column, row, here, there;
    (void)nav_floor_at(&l->best->floor, &l->best->joint, c->now.x, c->now.y, &column, &row);
    for (int n = 0; n < l->maps; n++) {
        const struct nav_particle_map *map = &l->map[n];
        if (!map->floor.known)
            continue;
        (void)nav_floor_at(&map->floor, &map->joint, c->now.x, c->now.y, &here, &there);
        agree += here == column && there == row;
    }
    return agree;
}

static const struct nav_stretch *loops_stretch(const struct nav_faces *f, long number)
{
    for (int n = 0; n < f->count; n++) {
        if (f->face[n].number == number)
            return &f->face[n].stretch;
    }
    return NULL;
}

/* A corner is one thing: that it is another, because one face or the other is, has the prior that either face has.
 * False: nothing was unsure, or not enough contacts are of both. */
static bool loops_corner(const struct nav_faces *f, const struct nav_corner_felt *felt, struct nav_closure *out)
{
    const struct nav_stretch *a = loops_stretch(f, felt->face[0]), *b = loops_stretch(f, felt->face[1]);
    if (!a || !b || !nav_stretch_confirmed(a) || !nav_stretch_confirmed(b) ||
        fmax(a->known, b->known) < NAV_CLOSURE_GROWN_M)
        return false;
    *out = (struct nav_closure){NAV_CLOSURE_CORNER, felt->last, felt->then, (a->doubt + b->doubt) / 2.0};
    return true;
}

static int loops_faces(const struct nav_loops *l, struct nav_closure *out)
{
    const struct nav_faces *f = &l->best->faces;
    int count = 0;
    for (int n = 0; n < f->count && count < NAV_LOOPS_MOST / 2; n++) {
        const struct nav_stretch *s = &f->face[n].stretch;
        struct nav_closure c = {NAV_CLOSURE_FACE, s->last, s->then, s->doubt};
        if (!s->open || s->last.row != l->row || !nav_stretch_confirmed(s) ||
            !loops_sure(l, loops_of_face(l, &c, false), &c))
            continue;
        (void)loops_of_face(l, &c, true);
        out[count++] = c;
    }
    return count;
}

static int loops_corners(const struct nav_loops *l, struct nav_closure *out)
{
    const struct nav_faces *f = &l->best->faces;
    int count = 0;
    for (int n = 0; n < f->corners.count && count < NAV_LOOPS_MOST / 2 - 1; n++) {
        const struct nav_corner_felt *felt = &f->corners.felt[n];
        struct nav_closure c;
        if (!felt->open || felt->last.row != l->row || !loops_corner(f, felt, &c) ||
            !loops_sure(l, loops_of_corner(l, &c, false), &c))
            continue;
        (void)loops_of_corner(l, &c, true);
        out[count++] = c;
    }
    return count;
}

int nav_loops_close(const struct nav_loops *l, struct nav_sequence *s, struct nav_closure *out)
{
    int count = loops_faces(l, out);
    count += loops_corners(l, out + count);
    struct nav_closure c = s->closure;
    if (s->weighed != l->row || !loops_sure(l, loops_of_tile(l, &c), &c))
        return count;
    nav_sequence_end(s);
    out[count++] = c;
    return count;
}
