/* Rows that wait for a path through them, and what a map along a path makes of them. */
#ifndef NAV_GRID_ROWS_H
#define NAV_GRID_ROWS_H

#include <math.h>

#include "grid_sense.h"
#include "record.h"
#include "touches.h"

enum { NAV_GRID_ROWS_MOST = 64 };

/* Rows since the last pose that was drawn, kept until the path through them is. */
struct nav_grid_rows {
    const struct nav_robot *robot;
    const struct nav_settings *settings;
    const struct nav_model *ray; /* [rays] */
    int rays, tips, classes, count;
    bool lined; /* the last row's contacts complete a line, whose direction is a compass where right angles are */
    struct nav_touches_line line;
    struct nav_pose step[NAV_GRID_ROWS_MOST];
    struct nav_record_contact *contact; /* [ROWS_MOST][rays] */
    float *window;                      /* [ROWS_MOST][tips][1 + classes] */
};

/* 0, or -1 without memory; nav_grid_rows_free either way. */
int nav_grid_rows_init(struct nav_grid_rows *, const struct nav_record *);
void nav_grid_rows_free(struct nav_grid_rows *);

/* Keeps a copy of a row, for which there must be room. Returns whether a whisker touches something in it. */
bool nav_grid_rows_keep(struct nav_grid_rows *, const struct nav_record_row *);

/* A whisker of a robot at this pose. */
struct nav_grid_whisker nav_grid_rows_whisker(const struct nav_grid_rows *, int ray, const struct nav_pose *);

/* The readings of a row's whiskers. */
const struct nav_record_contact *nav_grid_rows_contacts(const struct nav_grid_rows *, int row);

static inline bool nav_grid_touches(const struct nav_record_contact *c)
{
    return c->weight > 0.0F && !isinf(c->distance);
}

/* Log-likelihood of a row's contacts at a pose; then of what else it read: whiskers that touch nothing, and windows. */
double nav_grid_rows_touched(struct nav_grid, const struct nav_grid_rows *, int row, const struct nav_pose *);
double nav_grid_rows_read(struct nav_grid, const struct nav_grid_rows *, int row, const struct nav_pose *);

/* Learns all that a row read at a pose. */
void nav_grid_rows_learn(struct nav_grid, const struct nav_grid_rows *, int row, const struct nav_pose *);

#endif
