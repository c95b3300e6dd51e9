/* Small hand-drawn problems.
 *
 *     y 1.0 +-----+-----+     textures 0 and 1, tiles of 0.5 m, floor rows from the bottom: 0 1 / 1 0
 *           |  1  |  0  |     one box, 0.2 m wide, in the lower right corner
 *       0.5 +-----+-----+     robot: a texture tip 0.1 m ahead, an object whisker of 0.2 m straight ahead of its
 *           |  0  | 1 ##|     base 0.05 m before the centre
 *         0 +-----+-----+
 *           0    0.5    1.0 x */
#ifndef NAV_TESTS_ROOMS_H
#define NAV_TESTS_ROOMS_H

#include "filter.h"
#include "likelihood.h"

static const uint8_t ROOM_FLOOR[] = {0, 1, 1, 0};
static const struct nav_box ROOM_BOX[] = {{0.8, 0.0, 1.0, 0.3}};
static const struct nav_tip ROOM_TIP[] = {{0.1, 0.0}};
static const struct nav_ray ROOM_RAY[] = {{0.05, 0.0, 0.0, 0.2}};

static inline struct nav_problem room(void)
{
    struct nav_problem p = {
        .arena = {.size_x = 1.0,
                  .size_y = 1.0,
                  .tile = 0.5,
                  .columns = 2,
                  .rows = 2,
                  .floor = ROOM_FLOOR,
                  .classes = 2,
                  .boxes = 1,
                  .box = ROOM_BOX},
        .robot = {.body_radius = 0.05,
                  .odometry_relative = 0.05,
                  .radial_sigma = 0.005,
                  .tips = 1,
                  .tip = ROOM_TIP,
                  .rays = 1,
                  .ray = ROOM_RAY},
        .prior = {.mean = {0.5, 0.5, 0.0}, .sigma = {0.1, 0.1, 0.2}},
    };
    nav_settings_default(&p.settings);
    return p;
}

/* Log-likelihood of the row last read where sensors should meet these codes, sensor by sensor. */
static inline float summed(const struct nav_likelihood *l, const uint8_t *codes)
{
    float sum = 0.0f;
    for (int w = 0; w < l->whiskers; w++)
        sum += l->table[w][codes[w]];
    return sum;
}

#endif
