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
    double *weight;                /* [cells^3] log posterior, then posterior */
};

static void destroy(void *self)
{
    struct foveal *f = self;
    nav_likelihood_free(f->likelihood);
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
    f->cells = (int)settings->foveal.cells;
    f->spacing = settings->foveal.diameter_m / (f->cells - 1);
    f->spacing_theta = settings->foveal.span_deg * NAV_PI / 180.0 / (f->cells - 1);
    f->weight = calloc(points(f), sizeof *f->weight);
    f->likelihood = nav_likelihood_new(&problem->arena, &problem->robot, settings, f->spacing / sqrt(12.0));
    if (!f->likelihood || !f->weight) {
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

/* Offset of step i from the middle of an axis. */
static int from_middle(const struct foveal *f, size_t i)
{
    return (int)(i % (size_t)f->cells) - (f->cells - 1) / 2;
}

/* Pose of a grid point: egocentric offsets from the prior mode, number `index` with the heading running slowest. */
static struct nav_pose point(const struct foveal *f, size_t index)
{
    size_t n = (size_t)f->cells;
    return nav_compose(f->belief.mean,
                       (struct nav_pose){from_middle(f, index / n) * f->spacing, from_middle(f, index) * f->spacing,
                                         from_middle(f, index / n / n) * f->spacing_theta});
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

/* Equation 5 over one slice of the grid, as logarithms; -INFINITY where the robot cannot be. */
static void weigh_slice(struct foveal *f, const double information[9], size_t slice)
{
    size_t each = (size_t)f->cells * (size_t)f->cells;
    double c = cos(point(f, slice * each).theta), s = sin(point(f, slice * each).theta);
    for (size_t p = slice * each; p < (slice + 1) * each; p++) {
        struct nav_pose pose = point(f, p);
        const double d[3] = {pose.x - f->belief.mean.x, pose.y - f->belief.mean.y,
                             from_middle(f, slice) * f->spacing_theta};
        f->weight[p] = log_prior(information, d) +
                       nav_likelihood_standing(f->likelihood, &(struct nav_place){pose.x, pose.y, c, s});
    }
}

/* Fills the weights; returns the mode's index, or -1 when no point is free. */
static long weigh(struct foveal *f, const double information[9])
{
    long mode = -1;
    for (size_t slice = 0; slice < (size_t)f->cells; slice++)
        weigh_slice(f, information, slice);
    for (size_t p = 0; p < points(f); p++) {
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

/* The covariance of the fovea's own points about its centre: what the paper's shortcut puts in place of equation 7. */
static void inflate(const struct foveal *f, struct nav_gaussian *g)
{
    double steps = ((double)f->cells * f->cells - 1.0) / 12.0; /* variance of 1 .. n */
    *g = (struct nav_gaussian){.mean = g->mean};
    g->covariance[0] = g->covariance[4] = steps * f->spacing * f->spacing;
    g->covariance[8] = steps * f->spacing_theta * f->spacing_theta;
}

/* Adds the quantisation term. */
static void add_quantum(const struct nav_settings *settings, struct nav_gaussian *g)
{
    double quantum_rad = settings->foveal.quantum_deg * NAV_PI / 180.0;
    g->covariance[0] += settings->foveal.quantum_m * settings->foveal.quantum_m;
    g->covariance[4] += settings->foveal.quantum_m * settings->foveal.quantum_m;
    g->covariance[8] += quantum_rad * quantum_rad;
}

/* Equations 6 and 7: the mode, and the covariance about it. As printed the sum has no weights: 1331 points count alike,
 * and the readings matter only through which point is the mode. */
static void fit(struct foveal *f, long mode)
{
    const struct nav_settings *settings = &f->problem->settings;
    struct nav_gaussian fitted = {.mean = point(f, (size_t)mode)};
    for (size_t p = 0; p < points(f); p++) {
        struct nav_pose pose = point(f, p);
        double d[3] = {pose.x - fitted.mean.x, pose.y - fitted.mean.y, nav_wrap(pose.theta - fitted.mean.theta)};
        double weight = settings->foveal.printed > 0.0 ? 1.0 : f->weight[p];
        for (int a = 0; a < 9; a++)
            fitted.covariance[a] += weight * d[a / 3] * d[a % 3];
    }
    if (settings->foveal.inflate > 0.0)
        inflate(f, &fitted);
    add_quantum(settings, &fitted);
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
    out->bytes = sizeof *f + points(f) * sizeof *f->weight + nav_likelihood_bytes(f->likelihood);
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
