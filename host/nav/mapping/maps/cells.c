#include "cells.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Log-odds: a contact is of its cell, a whisker goes through it, the body stands on it; the most there is. */
static const double MET = 2.5, PASSED = 1.0, STOOD = 4.0, MOST = 6.0;
static const double SIGMAS = 2.0; /* of the position, that the body is taken to be smaller by */

int nav_cells_init(struct nav_cells *c)
{
    *c = (struct nav_cells){.from = {NAV_CELLS_SIDE, NAV_CELLS_SIDE}};
    c->odds = calloc((size_t)NAV_CELLS_SIDE * NAV_CELLS_SIDE, sizeof *c->odds);
    return c->odds ? 0 : -1;
}

void nav_cells_free(struct nav_cells *c)
{
    free(c->odds);
}

static void cells_blank(struct nav_cells *c)
{
    for (int row = c->from[1]; row < c->until[1]; row++)
        memset(c->odds + (ptrdiff_t)row * NAV_CELLS_SIDE + c->from[0], 0,
               (size_t)(c->until[0] - c->from[0]) * sizeof *c->odds);
}

void nav_cells_clear(struct nav_cells *c)
{
    cells_blank(c);
    for (int axis = 0; axis < 2; axis++) {
        c->from[axis] = NAV_CELLS_SIDE;
        c->until[axis] = 0;
    }
}

void nav_cells_copy(struct nav_cells *to, const struct nav_cells *from)
{
    cells_blank(to);
    for (int axis = 0; axis < 2; axis++) {
        to->from[axis] = from->from[axis];
        to->until[axis] = from->until[axis];
    }
    for (int row = from->from[1]; row < from->until[1]; row++) {
        ptrdiff_t at = (ptrdiff_t)row * NAV_CELLS_SIDE + from->from[0];
        memcpy(to->odds + at, from->odds + at, (size_t)(from->until[0] - from->from[0]) * sizeof *to->odds);
    }
}

int nav_cells_at(double metres)
{
    double cell = floor(metres / NAV_CELLS_M) + NAV_CELLS_SIDE / 2;
    return (int)fmax(fmin(cell, NAV_CELLS_SIDE), -1.0);
}

void nav_cells_hold(int from[2], int until[2], double x, double y)
{
    const double point[2] = {x, y};
    for (int axis = 0; axis < 2; axis++) {
        int cell = nav_cells_at(point[axis]);
        cell = cell < 0 ? 0 : cell > NAV_CELLS_SIDE - 1 ? NAV_CELLS_SIDE - 1 : cell;
        from[axis] = cell < from[axis] ? cell : from[axis];
        until[axis] = cell >= until[axis] ? cell + 1 : until[axis];
    }
}

double nav_cells_odds(const struct nav_cells *c, double x, double y)
{
    int column = nav_cells_at(x), row = nav_cells_at(y);
    if (column < 0 || row < 0 || column >= NAV_CELLS_SIDE || row >= NAV_CELLS_SIDE)
        return 0.0;
    return (double)c->odds[(ptrdiff_t)row * NAV_CELLS_SIDE + column];
}

static void cells_add(struct nav_cells *c, int column, int row, double odds)
{
    if (column < 0 || row < 0 || column >= NAV_CELLS_SIDE || row >= NAV_CELLS_SIDE)
        return;
    float *cell = &c->odds[(ptrdiff_t)row * NAV_CELLS_SIDE + column];
    *cell = (float)fmax(fmin((double)*cell + odds, MOST), -MOST);
}

static void cells_stand(struct nav_cells *c, struct nav_pose pose, double radius)
{
    int low = nav_cells_at(pose.y - radius), high = nav_cells_at(pose.y + radius);
    for (int row = low < 0 ? 0 : low; row <= high && row < NAV_CELLS_SIDE; row++) {
        double off = (row - NAV_CELLS_SIDE / 2 + 0.5) * NAV_CELLS_M - pose.y, half = radius * radius - off * off;
        if (half < 0.0)
            continue;
        int first = nav_cells_at(pose.x - sqrt(half) + NAV_CELLS_M / 2.0), last = nav_cells_at(pose.x + sqrt(half));
        for (int column = first < 0 ? 0 : first; column <= last && column < NAV_CELLS_SIDE; column++) {
            float *cell = &c->odds[(ptrdiff_t)row * NAV_CELLS_SIDE + column];
            *cell = fminf(*cell, (float)-STOOD);
        }
    }
}

static void cells_whisker(struct nav_cells *c, const struct nav_record_contact *contact, double length,
                          struct nav_pose base, double share)
{
    bool met = isfinite(contact->distance);
    double end = met ? (double)contact->distance : length, along = NAV_CELLS_M / 2.0;
    for (; along < end - (met ? NAV_CELLS_M : 0.0); along += NAV_CELLS_M)
        cells_add(c, nav_cells_at(base.x + along * cos(base.theta)), nav_cells_at(base.y + along * sin(base.theta)),
                  -share * PASSED);
    /* A contact is of what lies just beyond it. */
    end += NAV_CELLS_M / 4.0;
    if (met)
        cells_add(c, nav_cells_at(base.x + end * cos(base.theta)), nav_cells_at(base.y + end * sin(base.theta)),
                  share * MET);
    nav_cells_hold(c->from, c->until, base.x, base.y);
    nav_cells_hold(c->from, c->until, base.x + end * cos(base.theta), base.y + end * sin(base.theta));
}

void nav_cells_take(struct nav_cells *c, const struct nav_record *r, const struct nav_record_row *row,
                    struct nav_pose pose, double sigma)
{
    const struct nav_model *rays = nav_record_rays(r);
    double radius = r->problem->robot.body_radius - SIGMAS * sigma;
    /* How likely the cell is the one that the whisker is in. */
    double here = NAV_CELLS_M / sqrt(NAV_CELLS_M * NAV_CELLS_M + 12.0 * sigma * sigma);
    if (radius > 0.0) {
        cells_stand(c, pose, radius);
        nav_cells_hold(c->from, c->until, pose.x - radius, pose.y - radius);
        nav_cells_hold(c->from, c->until, pose.x + radius, pose.y + radius);
    }
    for (int ray = 0; ray < r->rays; ray++) {
        const struct nav_place *place = &rays[ray].place;
        struct nav_pose base = nav_compose(pose, (struct nav_pose){place->x, place->y, atan2(place->s, place->c)});
        if (row->contact[ray].weight > 0.0F)
            cells_whisker(c, &row->contact[ray], rays[ray].length, base, here * (double)row->contact[ray].weight);
    }
}
