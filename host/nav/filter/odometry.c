/* Dead reckoning: the prior's mean moved by the odometry; whiskers are not used. */
#include <stdlib.h>

#include "filter.h"
#include "gaussian.h"

struct odometry {
    const struct nav_problem *problem;
    struct nav_gaussian belief;
};

static void *create(const struct nav_problem *problem)
{
    struct odometry *o = calloc(1, sizeof *o);
    if (o)
        *o = (struct odometry){.problem = problem, .belief = nav_gaussian_prior(problem)};
    return o;
}

static void predict(void *self, const struct nav_motion *motion)
{
    struct odometry *o = self;
    struct nav_noise noise = nav_motion_noise(&o->problem->robot, &o->problem->settings, motion);
    nav_gaussian_move(&o->belief, motion->step, &noise);
}

static void update(void *self, const struct nav_evidence *evidence)
{
    (void)self;
    (void)evidence;
}

static void estimate(const void *self, struct nav_estimate *out)
{
    const struct odometry *o = self;
    nav_gaussian_estimate(&o->belief, out);
    out->evaluations = 0;
    out->states = 1;
    out->bytes = sizeof *o;
}

static long components(const void *self, struct nav_component *out, long room)
{
    const struct odometry *o = self;
    return nav_gaussian_components(&o->belief, out, room);
}

const struct nav_filter_ops nav_odometry_filter = {.name = "odometry",
                                                   .create = create,
                                                   .destroy = free,
                                                   .predict = predict,
                                                   .update = update,
                                                   .estimate = estimate,
                                                   .components = components};
