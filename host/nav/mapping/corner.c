#include "corner.h"

#include <math.h>

static const double MEET_M = 0.1; /* from the ends of two faces to the corner that they make */
static const double WIDE = 0.5;   /* sine of the angle between them, at least */

static struct nav_corner_line corner_line(const struct nav_face *g, const struct nav_joint *j)
{
    double nx = cos(j->mean[g->index]), ny = sin(j->mean[g->index]);
    return (struct nav_corner_line){nx, ny, nx * g->anchor_x + ny * g->anchor_y + j->mean[g->index + 1]};
}

static double corner_along(const struct nav_face *g, const struct nav_corner_line *l, double x, double y)
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
    return corner_ends(g, corner_along(g, &c->line[0], c->x, c->y)) &&
           corner_ends(h, corner_along(h, &c->line[1], c->x, c->y));
}

bool nav_corner_find(const struct nav_face *g, const struct nav_face *h, const struct nav_joint *j,
                     struct nav_corner *out)
{
    return corner_cross(g, h, j, out) && corner_both_end(g, h, out);
}
