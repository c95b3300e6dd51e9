/* Ground that was never mapped: where a robot may stand on it, and how likely it is to be there before anything is
 * read. */
#ifndef NAV_GROUND_H
#define NAV_GROUND_H

#include "obstacles.h"

/* Of a cell's middle; what is not mapped cannot be reached until it is found that it can. */
enum nav_ground_state { NAV_GROUND_BLOCKED, NAV_GROUND_MAPPED, NAV_GROUND_CUT_OFF, NAV_GROUND_REACHED };

struct nav_ground {
    double per_m; /* cells a metre; all is 0 where all ground is mapped */
    int columns, rows;
    uint8_t *state; /* [rows][columns] enum nav_ground_state */
    double weight;  /* prior of a place on it that can be reached, by that of one that is mapped: together they hold
                       NAV_ANYWHERE of the belief, or less where they are small */
    double open;    /* share of the arena where the robot may stand; 1 where all ground is mapped */
};

/* 0, or -1 without memory; nav_ground_free either way. radius: of the robot. */
int nav_ground_init(struct nav_ground *, const struct nav_obstacles *, double radius);
void nav_ground_free(struct nav_ground *);

/* Prior of a place that is clear of obstacles, by that of one that is mapped: 0 on ground that nobody comes to from
 * mapped ground, for walls or because the robot is too wide. */
double nav_ground_prior(const struct nav_ground *, const struct nav_obstacles *, double x, double y);

#endif
