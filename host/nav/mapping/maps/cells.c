#include "cells.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Log-odds: a contact is of its cell, a whisker goes through it, the body stands on it; the most there is. */
static const double MET = 2.5, PASSED = 1.0, STOOD = 4.0, MOST = 6.0;
static const double SIGMAS = 2.0; /* of the position, that the body is taken to be smaller by */

int nav_cells_init(struct nav_cells *c)
{
    c->odds = calloc((size_t)NAV_CELLS_SIDE * NAV_CELLS_SIDE, sizeof *c->odds);
    nav_cells_clear(c);
    return c->odds ? 0 : -1;
}

void nav_cells_free(struct nav_cells *c)
{
    free(c->odds);
}

void nav_cells_clear(struct nav_cells *c)
{
    if (c->odds)
        memset(c->odds, 0, (size_t)NAV_CELLS_SIDE * NAV_CELLS_SIDE * sizeof *c->odds);
    for (int axis = 0; axis < 2; axis++) {
        c->from[axis] = NAV_CELLS_SIDE;
        c->until[axis] = 0;
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

void nav_cells_add(struct nav_cells *c, const struct nav_cells *other, struct nav_pose place)
{
    for (int row = other->from[1]; row < other->until[1]; row++) {
        for (int column = other->from[0]; column < other->until[0]; column++) {
            float odds = other->odds[(ptrdiff_t)row * NAV_CELLS_SIDE + column];
            if (odds == 0.0F)
                continue;
            struct nav_pose middle = {(column - NAV_CELLS_SIDE / 2 + 0.5) * NAV_CELLS_M,
                                      (row - NAV_CELLS_SIDE / 2 + 0.5) * NAV_CELLS_M, 0.0};
            struct nav_pose at = nav_compose(place, middle);
            cells_add(c, nav_cells_at(at.x), nav_cells_at(at.y), (double)odds);
            nav_cells_hold(c->from, c->until, at.x, at.y);
        }
    }
}
