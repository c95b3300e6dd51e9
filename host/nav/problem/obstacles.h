/* The arena's boxes in buckets: which of them a robot at a place can touch. Set-up is linear in boxes and squares. */
#ifndef NAV_OBSTACLES_H
#define NAV_OBSTACLES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "arena.h"

/* Squares over the arena, each with copies of the boxes within `reach` of it, in the arena's order. */
struct nav_obstacles {
    const struct nav_arena *arena;
    double edge, per_m, reach; /* m; 1 / m; m */
    int columns, rows;
    uint32_t *first;     /* [rows * columns + 1] a square's boxes are number first[n] .. first[n + 1] - 1 */
    uint32_t *unknown;   /* [rows * columns] how many of them, the last, were never mapped */
    struct nav_box *box; /* square by square */
    int *which;          /* of the arena's boxes each is */
    uint8_t *wall;       /* [rows * columns] whether a wall is within reach */
};

/* reach: farthest point from a place that is ever asked about, m. 0, or -1 without memory; nav_obstacles_free either
 * way. */
int nav_obstacles_init(struct nav_obstacles *, const struct nav_arena *, double reach);
void nav_obstacles_free(struct nav_obstacles *);

/* The arena with the boxes within reach of (x, y) alone. Returns whether there is anything within reach, walls
 * included; *near is filled only then. */
bool nav_obstacles_near(const struct nav_obstacles *, double x, double y, struct nav_arena *near);

/* Answers as nav_arena_free does, for radii up to the reach. */
bool nav_obstacles_clear(const struct nav_obstacles *, double x, double y, double radius);

/* Number of the arena's box that holds a point within reach of the robot, -1: none. */
int nav_obstacles_at(const struct nav_obstacles *, double x, double y);

/* Takes one of the arena's boxes away, or puts it back. */
void nav_obstacles_hide(struct nav_obstacles *, int which, bool hidden);

size_t nav_obstacles_bytes(const struct nav_obstacles *);

#endif
