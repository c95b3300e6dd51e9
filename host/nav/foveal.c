/* The paper's foveal grid: a Gaussian belief, weighted on a small grid around its mode at each reading (eqs. 5-7).
 *
 * Equation 7 is weighted by the posterior here: as printed its sum does not depend on the readings at all. */
#include <math.h>
#include <stdlib.h>

#include "filter.h"
#include "gaussian.h"
#include "likelihood.h"

struct foveal {
    const struct nav_problem *problem;
    struct nav_likelihood *likelihood;
    struct nav_gaussian belief;
    int cells;                     /* per axis */
    double spacing, spacing_theta; /* m, rad */
    uint8_t *codes;                /* [whiskers] */
    double *weight;                /* [cells^3] log posterior, then posterior */
};

static void destroy(void *self)
{
    struct foveal *f = self;
    nav_likelihood_free(f->likelihood);
    free(f->codes);
    free(f->weight);
    free(f);
}

static size_t points(const struct foveal *f)
{
    return (size_t)f->cells * (size_t)f->cells * (size_t)f->cells;
}

static void *create(const struct nav_problem *problem)
{
    const struct nav_settings *settings = &problem->settings;
    struct foveal *f = calloc(1, sizeof *f);
    if (!f)
        return NULL;
    f->problem = problem;
    f->belief = nav_gaussian_prior(problem);
    f->cells = (int)settings->foveal_cells;
    f->spacing = settings->foveal_diameter_m / (f->cells - 1);
    f->spacing_theta = settings->foveal_span_deg * NAV_PI / 180.0 / (f->cells - 1);
    f->likelihood = nav_likelihood_new(&problem->arena, &problem->robot, settings, f->spacing / sqrt(12.0));
    f->codes = calloc((size_t)(problem->robot.tips + problem->robot.rays) + 1, 1);
    f->weight = calloc(points(f), sizeof *f->weight);
    if (!f->likelihood || !f->codes || !f->weight) {
        destroy(f);
        return NULL;
    }
    return f;
}

static void predict(void *self, const struct nav_motion *motion)
{
    struct foveal *f = self;
    struct nav_noise noise = nav_motion_noise(&f->problem->robot, &f->problem->settings, motion);
    nav_gaussian_move(&f->belief, motion->step, &noise);
}

/* Pose of a grid point: egocentric offsets from the prior mode, number `index` with the heading running fastest. */
static struct nav_pose point(const struct foveal *f, size_t index)
{
    int n = f->cells, half = (n - 1) / 2;
    int k = (int)(index % (size_t)n) - half, j = (int)(index / (size_t)n % (size_t)n) - half;
    int i = (int)(index / (size_t)(n * n)) - half;
    return nav_compose(f->belief.mean, (struct nav_pose){i * f->spacing, j * f->spacing, k * f->spacing_theta});
}

static void difference(const struct foveal *f, struct nav_pose pose, double d[3])
{
    d[0] = pose.x - f->belief.mean.x;
    d[1] = pose.y - f->belief.mean.y;
    d[2] = nav_wrap(pose.theta - f->belief.mean.theta);
}

static double log_prior(const double information[9], const double d[3])
{
    double sum = 0.0;
    for (int a = 0; a < 3; a++) {
        for (int b = 0; b < 3; b++)
            sum += d[a] * information[3 * a + b] * d[b];
    }
    return -0.5 * sum;
}

/* Equation 5 at one grid point, as a logarithm; -INFINITY where the robot cannot be. */
static double log_posterior(struct foveal *f, const double information[9], struct nav_pose pose)
{
    const struct nav_arena *arena = &f->problem->arena;
    const struct nav_robot *robot = &f->problem->robot;
    double d[3];
    if (!nav_arena_free(arena, pose.x, pose.y, robot->body_radius))
        return -INFINITY;
    difference(f, pose, d);
    nav_likelihood_expect(f->likelihood, arena, robot, pose, f->codes);
    return log_prior(information, d) + (double)nav_likelihood_of(f->likelihood, f->codes);
}

/* Fills the weights; returns the mode's index, or -1 when no point is free. */
static long weigh(struct foveal *f, const double information[9])
{
    long mode = -1;
    for (size_t p = 0; p < points(f); p++) {
        f->weight[p] = log_posterior(f, information, point(f, p));
        if (f->weight[p] > (mode < 0 ? -INFINITY : f->weight[mode]))
            mode = (long)p;
    }
    if (mode < 0)
        return -1;
    double best = f->weight[mode], total = 0.0;
    for (size_t p = 0; p < points(f); p++)
        total += f->weight[p] = exp(f->weight[p] - best);
    for (size_t p = 0; p < points(f); p++)
        f->weight[p] /= total;
    return mode;
}

/* Equations 6 and 7: the mode, and the covariance about it, with the quantisation term. */
static void fit(struct foveal *f, long mode)
{
    const struct nav_settings *settings = &f->problem->settings;
    struct nav_gaussian fitted = {.mean = point(f, (size_t)mode)};
    for (size_t p = 0; p < points(f); p++) {
        struct nav_pose pose = point(f, p);
        double d[3] = {pose.x - fitted.mean.x, pose.y - fitted.mean.y, nav_wrap(pose.theta - fitted.mean.theta)};
        for (int a = 0; a < 9; a++)
            fitted.covariance[a] += f->weight[p] * d[a / 3] * d[a % 3];
    }
    double quantum_rad = settings->foveal_quantum_deg * NAV_PI / 180.0;
    fitted.covariance[0] += settings->foveal_quantum_m * settings->foveal_quantum_m;
    fitted.covariance[4] += settings->foveal_quantum_m * settings->foveal_quantum_m;
    fitted.covariance[8] += quantum_rad * quantum_rad;
    fitted.mean.theta = nav_wrap(fitted.mean.theta);
    f->belief = fitted;
}

static void update(void *self, const struct nav_evidence *evidence)
{
    struct foveal *f = self;
    double information[9];
    if (!nav_gaussian_invert(f->belief.covariance, information))
        return;
    nav_likelihood_read(f->likelihood, evidence);
    long mode = weigh(f, information);
    if (mode >= 0)
        fit(f, mode);
}

static void estimate(const void *self, struct nav_estimate *out)
{
    const struct foveal *f = self;
    nav_gaussian_estimate(&f->belief, out);
    out->evaluations = out->distinct = out->touched = (long)points(f);
    out->states = (long)points(f);
    out->bytes = sizeof *f + points(f) * sizeof *f->weight;
}

static long components(const void *self, struct nav_component *out, long room)
{
    const struct foveal *f = self;
    return nav_gaussian_components(&f->belief, out, room);
}

const struct nav_filter_ops nav_foveal_filter = {.name = "foveal",
                                                 .create = create,
                                                 .destroy = destroy,
                                                 .predict = predict,
                                                 .update = update,
                                                 .estimate = estimate,
                                                 .components = components};
