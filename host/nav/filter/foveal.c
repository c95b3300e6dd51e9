/* The paper's foveal grid: a Gaussian belief, weighted on a small grid around its mode at each reading (eqs. 5-7).
 *
 * Equation 7 is weighted by the posterior: as printed its sum does not depend on the readings. By equation 6 the mean
 * is the grid's mode, so a correction is a whole step or none: the method's limit (docs/results/nav.md). */
#include <math.h>
#include <stdlib.h>

#include "filter.h"
#include "gaussian.h"
#include "likelihood.h"
#include "mixture.h"

/* Between the outermost cells and headings, as in the paper. */
static const double DIAMETER_M = 0.25, SPAN_RAD = NAV_PI / 2.0;

struct foveal {
    const struct nav_problem *problem;
    struct nav_likelihood *likelihood;
    struct nav_gaussian belief;
    int cells;                     /* per axis */
    double spacing, spacing_theta; /* m, rad */
    double *weight;                /* [cells^3] log posterior, then posterior */
};

static void foveal_destroy(void *self)
{
    struct foveal *f = self;
    nav_likelihood_free(f->likelihood);
    free(f->weight);
    free(f);
}

static size_t foveal_points(const struct foveal *f)
{
    return (size_t)f->cells * (size_t)f->cells * (size_t)f->cells;
}

static void *foveal_create(const struct nav_problem *problem)
{
    const struct nav_settings *settings = &problem->settings;
    struct foveal *f = calloc(1, sizeof *f);
    if (!f)
        return NULL;
    f->problem = problem;
    f->belief = nav_mixture_prior(problem);
    f->cells = (int)settings->foveal.cells;
    f->spacing = DIAMETER_M / (f->cells - 1);
    f->spacing_theta = SPAN_RAD / (f->cells - 1);
    struct nav_cell cell;
    if (nav_problem_cell(problem, 0.0, &cell)) {
        free(f);
        return NULL;
    }
    if (cell.edge < f->spacing) { /* a scene of finer detail than the paper's has a smaller fovea */
        f->spacing = cell.edge;
        f->spacing_theta = fmin(cell.heading, f->spacing_theta);
    }
    f->weight = calloc(foveal_points(f), sizeof *f->weight);
    f->likelihood = nav_likelihood_new(&problem->arena, &problem->robot, settings, f->spacing / sqrt(12.0));
    if (!f->likelihood || !f->weight) {
        foveal_destroy(f);
        return NULL;
    }
    return f;
}

static void foveal_predict(void *self, const struct nav_motion *motion)
{
    struct foveal *f = self;
    struct nav_noise noise = nav_motion_noise(&f->problem->robot, &f->problem->settings, motion);
    nav_gaussian_move(&f->belief, motion->step, &noise);
    if (motion->carried)
        nav_gaussian_carry(&f->belief, &f->problem->arena);
}

/* Offset of step i from the middle of an axis. */
static int foveal_from_middle(const struct foveal *f, size_t i)
{
    return (int)(i % (size_t)f->cells) - (f->cells - 1) / 2;
}

/* Pose of a grid point: egocentric offsets from the prior mode, number `index` with the heading running slowest. */
static struct nav_pose foveal_point(const struct foveal *f, size_t index)
{
    size_t n = (size_t)f->cells;
    return nav_compose(f->belief.mean, (struct nav_pose){foveal_from_middle(f, index / n) * f->spacing,
                                                         foveal_from_middle(f, index) * f->spacing,
                                                         foveal_from_middle(f, index / n / n) * f->spacing_theta});
}

static double foveal_log_prior(const double information[9], const double d[3])
{
    double sum = 0.0;
    for (int a = 0; a < 9; a++)
        sum += d[a / 3] * information[a] * d[a % 3];
    return -0.5 * sum;
}

/* Equation 5 over one slice of the grid, as logarithms; -INFINITY where the robot cannot be. */
static void foveal_weigh_slice(struct foveal *f, const double information[9], size_t slice)
{
    size_t each = (size_t)f->cells * (size_t)f->cells;
    double c = cos(foveal_point(f, slice * each).theta), s = sin(foveal_point(f, slice * each).theta);
    for (size_t p = slice * each; p < (slice + 1) * each; p++) {
        struct nav_pose pose = foveal_point(f, p);
        const double d[3] = {pose.x - f->belief.mean.x, pose.y - f->belief.mean.y,
                             foveal_from_middle(f, slice) * f->spacing_theta};
        f->weight[p] = foveal_log_prior(information, d) +
                       nav_likelihood_standing(f->likelihood, &(struct nav_place){pose.x, pose.y, c, s});
    }
}

/* Fills the weights; returns the mode's index, or -1 when no point is free. */
static long foveal_weigh(struct foveal *f, const double information[9])
{
    long mode = -1;
    for (size_t slice = 0; slice < (size_t)f->cells; slice++)
        foveal_weigh_slice(f, information, slice);
    for (size_t p = 0; p < foveal_points(f); p++) {
        if (f->weight[p] > (mode < 0 ? -INFINITY : f->weight[mode]))
            mode = (long)p;
    }
    if (mode < 0)
        return -1;
    double best = f->weight[mode], total = 0.0;
    for (size_t p = 0; p < foveal_points(f); p++)
        total += f->weight[p] = exp(f->weight[p] - best);
    for (size_t p = 0; p < foveal_points(f); p++)
        f->weight[p] /= total;
    return mode;
}

/* The covariance of the fovea's own points about its centre: what the paper's shortcut puts in place of equation 7. */
static void foveal_inflate(const struct foveal *f, struct nav_gaussian *g)
{
    double steps = ((double)f->cells * f->cells - 1.0) / 12.0; /* variance of 1 .. n */
    *g = (struct nav_gaussian){.mean = g->mean};
    g->covariance[0] = g->covariance[4] = steps * f->spacing * f->spacing;
    g->covariance[8] = steps * f->spacing_theta * f->spacing_theta;
}

/* Equations 6 and 7: the mode, and the covariance about it. */
static void foveal_fit(struct foveal *f, long mode)
{
    const struct nav_foveal_settings *s = &f->problem->settings.foveal;
    struct nav_gaussian fitted = {.mean = foveal_point(f, (size_t)mode)};
    for (size_t p = 0; p < foveal_points(f); p++) {
        struct nav_pose pose = foveal_point(f, p);
        double d[3] = {pose.x - fitted.mean.x, pose.y - fitted.mean.y, nav_wrap(pose.theta - fitted.mean.theta)};
        for (int a = 0; a < 9; a++)
            fitted.covariance[a] += f->weight[p] * d[a / 3] * d[a % 3];
    }
    if (s->inflate > 0.0)
        foveal_inflate(f, &fitted);
    for (int a = 0; a < 9; a += 4)
        fitted.covariance[a] += pow(a < 8 ? s->quantum_m : s->quantum_deg * NAV_PI / 180.0, 2.0);
    fitted.mean.theta = nav_wrap(fitted.mean.theta);
    f->belief = fitted;
}

static void foveal_update(void *self, const struct nav_evidence *evidence)
{
    struct foveal *f = self;
    double information[9];
    if (!nav_gaussian_invert(f->belief.covariance, information))
        return;
    nav_likelihood_read(f->likelihood, evidence);
    long mode = foveal_weigh(f, information);
    if (mode >= 0)
        foveal_fit(f, mode);
}

static void foveal_estimate(const void *self, struct nav_estimate *out)
{
    const struct foveal *f = self;
    nav_gaussian_estimate(&f->belief, out);
    out->evaluations = out->distinct = out->touched = (long)foveal_points(f);
    out->states = (long)foveal_points(f);
    out->bytes = sizeof *f + foveal_points(f) * sizeof *f->weight + nav_likelihood_bytes(f->likelihood);
}

static long foveal_components(const void *self, struct nav_component *out, long room)
{
    const struct foveal *f = self;
    return nav_gaussian_components(&f->belief, out, room);
}

const struct nav_filter_ops nav_foveal_filter = {.name = "foveal",
                                                 .create = foveal_create,
                                                 .destroy = foveal_destroy,
                                                 .predict = foveal_predict,
                                                 .update = foveal_update,
                                                 .estimate = foveal_estimate,
                                                 .components = foveal_components};
