#include "corner.h"

#include <math.h>

static const double MEET_M = 0.1;    /* from the ends of two faces to the corner that they make */
static const double WIDE = 0.5;      /* sine of the angle between them, at least */
static const double NEAR_M = 0.25;   /* from a corner, where its faces are felt ... */
static const double SHORTLY_M = 0.3; /* ... within so much of the way */

static struct nav_corner_line corner_line(const struct nav_face *g, const struct nav_joint *j)
{
    double nx = cos(j->mean[g->index]), ny = sin(j->mean[g->index]);
    return (struct nav_corner_line){nx, ny, nx * g->anchor_x + ny * g->anchor_y + j->mean[g->index + 1]};
}

double nav_corner_along(const struct nav_face *g, const struct nav_corner_line *l, double x, double y)
{
    return l->nx * (y - g->anchor_y) - l->ny * (x - g->anchor_x);
}

/* Whether a felt stretch of the face ends near there. */
static bool corner_ends(const struct nav_face *g, double along)
{
    double low, high;
    for (int cell = nav_face_stretch(g, 0, &low, &high); cell > 0; cell = nav_face_stretch(g, cell, &low, &high)) {
        if (fmin(fabs(along - low), fabs(along - high)) <= MEET_M)
            return true;
    }
    return false;
}

/* Where the lines of two faces cross. False: at no wide angle. */
static bool corner_cross(const struct nav_face *g, const struct nav_face *h, const struct nav_joint *j,
                         struct nav_corner *out)
{
    struct nav_corner_line a = corner_line(g, j), b = corner_line(h, j);
    double det = a.nx * b.ny - a.ny * b.nx;
    double x = (a.offset * b.ny - b.offset * a.ny) / det, y = (a.nx * b.offset - b.nx * a.offset) / det;
    *out = (struct nav_corner){.x = x, .y = y, .sine = det, .line = {a, b}};
    return fabs(det) >= WIDE;
}

/* Whether stretches of both that were felt end there. */
static bool corner_both_end(const struct nav_face *g, const struct nav_face *h, const struct nav_corner *c)
{
    return corner_ends(g, nav_corner_along(g, &c->line[0], c->x, c->y)) &&
           corner_ends(h, nav_corner_along(h, &c->line[1], c->x, c->y));
}

bool nav_corner_find(const struct nav_face *g, const struct nav_face *h, const struct nav_joint *j,
                     struct nav_corner *out)
{
    return corner_cross(g, h, j, out) && corner_both_end(g, h, out);
}

/* In place of the one that was felt the longest ago, where there is no room. */
static void corners_add(struct nav_corners *c, struct nav_corner_felt felt)
{
    int at = 0;
    for (int n = 1; n < c->count; n++)
        at = c->felt[n].last.way < c->felt[at].last.way ? n : at;
    c->felt[c->count < NAV_CORNERS_MOST ? c->count++ : at] = felt;
}

/* The corner of two faces is felt now. */
static void corners_meet(struct nav_corners *c, const long face[2], struct nav_sighting now)
{
    for (int n = 0; n < c->count; n++) {
        struct nav_corner_felt *felt = &c->felt[n];
        if (felt->face[0] != face[0] || felt->face[1] != face[1])
            continue;
        if (now.way - felt->last.way > NAV_CLOSURE_AWAY_M) {
            felt->then = felt->last;
            felt->open = true;
        }
        felt->last = now;
        return;
    }
    corners_add(c, (struct nav_corner_felt){{face[0], face[1]}, now, now, false});
}

/* Whether the face was felt near a place of it the last time. */
static bool corner_near(const struct nav_face *g, const struct nav_corner *c, int which)
{
    return fabs(nav_corner_along(g, &c->line[which], c->x, c->y) - g->felt_at) <= NEAR_M;
}

void nav_corners_feel(struct nav_corners *c, const struct nav_face *g, const struct nav_face *h,
                      const struct nav_joint *j)
{
    struct nav_sighting now = g->stretch.last;
    struct nav_corner corner;
    if (now.way - h->stretch.last.way > SHORTLY_M || !corner_cross(g, h, j, &corner) || !corner_near(g, &corner, 0) ||
        !corner_near(h, &corner, 1) || !corner_both_end(g, h, &corner))
        return;
    double dx = corner.x - j->mean[NAV_JOINT_X], dy = corner.y - j->mean[NAV_JOINT_Y];
    double cosine = cos(j->mean[NAV_JOINT_HEADING]), sine = sin(j->mean[NAV_JOINT_HEADING]);
    now.x = cosine * dx + sine * dy;
    now.y = cosine * dy - sine * dx;
    bool ordered = g->number < h->number;
    corners_meet(c, (long[2]){ordered ? g->number : h->number, ordered ? h->number : g->number}, now);
}
