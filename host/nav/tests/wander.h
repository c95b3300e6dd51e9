/* A robot that wanders through a small arena and reports rows: two floor whiskers that are right in 85 % of windows,
 * three object whiskers with 5 mm of noise and 5 % misses, 3 % of odometry noise. For filters that must find it. */
#ifndef NAV_TESTS_WANDER_H
#define NAV_TESTS_WANDER_H

#include <math.h>

#include "filter.h"
#include "rng.h"

enum { WANDER_TIPS = 2, WANDER_RAYS = 3, WANDER_CLASSES = 3 };

static const uint8_t WANDER_FLOOR[] = {0, 1, 2, 2, 1, 0, 1, 2, 0, 2, 0, 0, 1, 1, 2, 0};
static const uint8_t WANDER_TWIN_FLOOR[] = {0, 1, 2, 0, 1, 2, 0, 1, 1, 0, 2, 1, 0, 2, 1, 0}; /* half a turn: the same */
static const struct nav_box WANDER_BOX[] = {{0.3, 1.2, 0.7, 1.5}};
static const struct nav_tip WANDER_TIP[] = {{0.05, 0.12}, {0.05, -0.12}};
static const struct nav_ray WANDER_RAY[] = {{0.08, 0.0, 0.0, 0.14}, {0.06, 0.06, 0.7, 0.14}, {0.06, -0.06, -0.7, 0.14}};

struct wander {
    struct nav_problem problem;
    struct nav_rng rng;
    struct nav_pose pose;
    double left; /* of a turn on the spot, rad */
    long rows;
    double texture[WANDER_TIPS * WANDER_CLASSES], radial[WANDER_RAYS];
    struct nav_row row;
};

static inline struct wander wander_new(uint64_t seed)
{
    struct wander w = {
        .problem = {.arena = {.size_x = 2.0,
                              .size_y = 2.0,
                              .tile = 0.5,
                              .columns = 4,
                              .rows = 4,
                              .floor = WANDER_FLOOR,
                              .classes = WANDER_CLASSES,
                              .boxes = 1,
                              .box = WANDER_BOX},
                    .robot = {.body_radius = 0.1,
                              .odometry_relative = 0.05,
                              .radial_sigma = 0.005,
                              .tips = WANDER_TIPS,
                              .tip = WANDER_TIP,
                              .rays = WANDER_RAYS,
                              .ray = WANDER_RAY},
                    .prior = {.mean = {1.0, 1.0, 0.5}, .sigma = {0.02, 0.02, 0.03}},
                    .seed = 7},
        .pose = {1.0, 1.0, 0.5},
    };
    nav_settings_default(&w.problem.settings);
    nav_rng_seed(&w.rng, seed, 0);
    return w;
}

static inline void wander_read(struct wander *w)
{
    const struct nav_arena *arena = &w->problem.arena;
    double c = cos(w->pose.theta), s = sin(w->pose.theta);
    for (int t = 0; t < WANDER_TIPS; t++) {
        const struct nav_tip *tip = &WANDER_TIP[t];
        int said = nav_arena_texture(arena, w->pose.x + c * tip->x - s * tip->y, w->pose.y + s * tip->x + c * tip->y);
        if (nav_rng_uniform(&w->rng) > 0.85)
            said = (said + 1 + (nav_rng_uniform(&w->rng) > 0.5)) % WANDER_CLASSES;
        for (int k = 0; k < WANDER_CLASSES; k++)
            w->texture[t * WANDER_CLASSES + k] = log(k == said ? 0.85 : 0.075);
    }
    for (int r = 0; r < WANDER_RAYS; r++) {
        const struct nav_ray *ray = &WANDER_RAY[r];
        double range = nav_arena_range(arena, w->pose.x + c * ray->x - s * ray->y, w->pose.y + s * ray->x + c * ray->y,
                                       w->pose.theta + ray->yaw, ray->length);
        bool felt = isfinite(range) && nav_rng_uniform(&w->rng) > 0.05;
        w->radial[r] = felt ? fmax(range + 0.005 * nav_rng_normal(&w->rng), 0.0) : (double)INFINITY;
    }
}

/* One row later; the readings stay valid until the next call. */
static inline const struct nav_row *wander_on(struct wander *w)
{
    const struct nav_problem *p = &w->problem;
    struct nav_pose step = {0.02, 0.0, 0.02 * nav_rng_normal(&w->rng)};
    struct nav_pose to = nav_compose(w->pose, step);
    if (w->left <= 0.0 && !nav_arena_free(&p->arena, to.x, to.y, p->robot.body_radius))
        w->left = 1.0 + 2.0 * nav_rng_uniform(&w->rng);
    if (w->left > 0.0) {
        step = (struct nav_pose){0.0, 0.0, 0.1};
        w->left -= 0.1;
    }
    w->pose = nav_compose(w->pose, step);
    w->pose.theta = nav_wrap(w->pose.theta);
    wander_read(w);
    w->row = (struct nav_row){.t_s = 0.1 * (double)++w->rows, .texture = w->texture, .radial_m = w->radial};
    w->row.odometry[0] = step.x * (1.0 + 0.03 * nav_rng_normal(&w->rng));
    w->row.odometry[2] = step.theta * (1.0 + 0.03 * nav_rng_normal(&w->rng));
    return &w->row;
}

static inline double wander_error(const struct wander *w, const struct nav_estimate *e)
{
    return hypot(e->pose.x - w->pose.x, e->pose.y - w->pose.y);
}

#endif
