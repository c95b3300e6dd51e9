/* When a texture whisker crossed from one surface to another, for filters that can use nothing else of a texture.
 *
 * What a tip reads is constant on a tile and jumps at its border: it has no derivative in the pose, so a Kalman filter
 * learns nothing from it inside a tile. A border crossing, though, is a sighting of a straight line at the tip. A CUSUM
 * test on the likelihood ratio finds it a few rows late, whence the path since then is kept. */
#ifndef NAV_BORDERS_H
#define NAV_BORDERS_H

#include <stdbool.h>

#include "arena.h"
#include "likelihood.h"

struct nav_crossing {
    int from, to;          /* texture indices */
    struct nav_tip point;  /* where the tip crossed, in the robot's present frame, m */
    struct nav_tip toward; /* unit vector of the tip's motion then, present frame */
    double sigma;          /* of the place along the motion, m */
};

struct nav_borders {
    int tips, classes;
    const struct nav_tip *tip;
    int *surface;           /* [tips] texture index under the tip; -1 before the first reading */
    double *held;           /* [tips] evidence for it, nats; a crossing counts only from a surface that was sure once */
    double *score;          /* [tips][classes] CUSUM of each other texture, nats */
    struct nav_pose *since; /* [tips][classes] motion since that score rose from nothing */
    struct nav_pose last;   /* motion between the last two readings */
};

/* 0, or -1 without memory; nav_borders_free either way. */
int nav_borders_init(struct nav_borders *, const struct nav_arena *, const struct nav_robot *);
void nav_borders_free(struct nav_borders *);

/* Follows the robot, every row. */
void nav_borders_move(struct nav_borders *, struct nav_pose step);

/* Forgets what is under the tips: the robot was carried. */
void nav_borders_forget(struct nav_borders *);

/* Takes tip number `tip`'s log-likelihoods by texture; true when they show that it has crossed. */
bool nav_borders_read(struct nav_borders *, int tip, const float *loglik, struct nav_crossing *);

/* To be called after a row's readings: the next motion starts here. */
void nav_borders_row_done(struct nav_borders *);

#endif
