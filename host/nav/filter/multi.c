/* Several Gaussians with weights: the paper's remark that even two hypotheses would help, taken to a few dozen.
 *
 * Each mode is weighed at the same fixed set of points, scaled to its covariance (brute force, as the fovea, since
 * tactile likelihoods are not smooth), and becomes a Gaussian again: about the points' mean, or two of them where the
 * points fall into two heaps. Its weight follows its evidence. A reading that would leave only a few points is
 * flattened until enough of them count: a mode never grows surer than its points can show. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "filter.h"
#include "likelihood.h"
#include "multi.h"
#include "rng.h"

static const double EFFECTIVE_LEAST = 0.1; /* share of the points that must count */
enum { FLATTENINGS_MOST = 12, HEADINGS = 8 };

struct multi {
    const struct nav_problem *problem;
    struct nav_likelihood *likelihood;
    struct multi_modes modes, spare;
    int points;
    double *normal;          /* [points][3] standard normal */
    double *offset, *weight; /* [points][3], [points] of the mode at work */
    double *half;            /* [points] */
    long evaluations;
};

static void destroy(void *self)
{
    struct multi *m = self;
    nav_likelihood_free(m->likelihood);
    free(m->modes.at);
    free(m->spare.at);
    free(m->normal);
    free(m->offset);
    free(m->weight);
    free(m->half);
    free(m);
}

/* Points of a standard normal in mirrored pairs, stretched until their covariance is exactly 1: with mean 0 a mode that
 * learns nothing stays as it is, however often it is refitted. */
static void draw_points(struct multi *m)
{
    struct nav_rng rng;
    nav_rng_seed(&rng, m->problem->seed, 0);
    for (int n = 0; n < m->points; n++) {
        m->weight[n] = 1.0 / m->points;
        for (int i = 0; i < 3; i++)
            m->normal[3 * n + i] = n % 2 ? -m->normal[3 * (n - 1) + i] : nav_rng_normal(&rng);
    }
    const struct multi_points all = {m->normal, m->weight, m->points};
    double root[9];
    multi_root(multi_fit((struct nav_pose){0.0, 0.0, 0.0}, &all).covariance, root);
    for (int n = 0; n < m->points; n++) { /* forward substitution */
        double *z = m->normal + 3 * n;
        z[0] /= root[0];
        z[1] = (z[1] - root[3] * z[0]) / root[4];
        z[2] = (z[2] - root[6] * z[0] - root[7] * z[1]) / root[8];
    }
}

/* Spreads modes evenly over the arena and all headings, as many as there is room for. */
static void spread(struct multi *m)
{
    const struct nav_arena *arena = &m->problem->arena;
    double each = sqrt(arena->size_x * arena->size_y * HEADINGS / m->modes.room);
    int nx = (int)fmax(floor(arena->size_x / each), 1.0), ny = (int)fmax(floor(arena->size_y / each), 1.0);
    double sx = arena->size_x / nx, sy = arena->size_y / ny, st = 2.0 * NAV_PI / HEADINGS;
    m->modes.count = 0;
    for (int n = 0; n < nx * ny * HEADINGS && m->modes.count < m->modes.room; n++) {
        struct multi_mode mode = {.weight = 1.0};
        mode.belief.mean =
            (struct nav_pose){(n % nx + 0.5) * sx, (n / nx % ny + 0.5) * sy, nav_wrap((n / (nx * ny) + 0.5) * st)};
        mode.belief.covariance[0] = sx * sx / 12.0;
        mode.belief.covariance[4] = sy * sy / 12.0;
        mode.belief.covariance[8] = st * st / 12.0;
        m->modes.at[m->modes.count++] = mode;
    }
    multi_normalise(&m->modes);
}

static void *create(const struct nav_problem *problem)
{
    struct multi *m = calloc(1, sizeof *m);
    if (!m)
        return NULL;
    m->problem = problem;
    m->points = (int)problem->settings.multi.points / 2 * 2;
    m->modes.room = m->spare.room = (int)problem->settings.multi.modes;
    size_t points = (size_t)m->points, room = (size_t)m->modes.room;
    m->modes.at = calloc(room, sizeof *m->modes.at);
    m->spare.at = calloc(room, sizeof *m->spare.at);
    m->normal = calloc(points * 3, sizeof *m->normal);
    m->offset = calloc(points * 3, sizeof *m->offset);
    m->weight = calloc(points, sizeof *m->weight);
    m->half = calloc(points, sizeof *m->half);
    m->likelihood = nav_likelihood_new(&problem->arena, &problem->robot, &problem->settings, 0.0);
    if (!m->likelihood || !m->modes.at || !m->spare.at || !m->normal || !m->offset || !m->weight || !m->half) {
        destroy(m);
        return NULL;
    }
    draw_points(m);
    m->modes.at[0] = (struct multi_mode){.belief = nav_gaussian_prior(problem), .weight = 1.0};
    m->modes.count = 1;
    if (problem->prior.uniform)
        spread(m);
    else if (problem->prior.bumps > 0)
        multi_gather(&m->modes, problem->prior.bump, problem->prior.bumps);
    return m;
}

static void predict(void *self, const struct nav_motion *motion)
{
    struct multi *m = self;
    struct nav_noise noise = nav_motion_noise(&m->problem->robot, &m->problem->settings, motion);
    for (int k = 0; k < m->modes.count; k++)
        nav_gaussian_move(&m->modes.at[k].belief, motion->step, &noise);
}

/* Log-likelihoods at a mode's points go to weight; returns the best. */
static double look(struct multi *m, const struct nav_gaussian *g)
{
    double root[9], best = -INFINITY;
    multi_root(g->covariance, root);
    for (int n = 0; n < m->points; n++) {
        const double *z = m->normal + 3 * n;
        double *o = m->offset + 3 * n;
        for (int i = 0; i < 3; i++)
            o[i] = root[3 * i] * z[0] + root[3 * i + 1] * z[1] + root[3 * i + 2] * z[2];
        double theta = g->mean.theta + o[2];
        const struct nav_place at = {g->mean.x + o[0], g->mean.y + o[1], cos(theta), sin(theta)};
        m->weight[n] = nav_likelihood_standing(m->likelihood, &at);
        best = fmax(best, m->weight[n]);
    }
    m->evaluations += m->points;
    return best;
}

/* Weights of half = exp(power * (loglik - best)), summing to 1; returns the effective number of points. */
static double effective(struct multi *m, double best, double power)
{
    double sum = 0.0, squares = 0.0;
    for (int n = 0; n < m->points; n++) {
        m->half[n] = exp(power * (m->weight[n] - best));
        sum += m->half[n];
        squares += m->half[n] * m->half[n];
    }
    for (int n = 0; n < m->points; n++)
        m->half[n] /= sum;
    return sum * sum / squares;
}

static double evidence(const struct multi *m, double best)
{
    double sum = 0.0;
    for (int n = 0; n < m->points; n++)
        sum += exp(m->weight[n] - best);
    return best + log(sum / m->points);
}

static void add(struct multi *m, struct nav_pose from, double weight)
{
    if (m->spare.count == m->spare.room)
        return;
    const struct multi_points points = {m->offset, m->weight, m->points};
    double quantum = m->problem->settings.multi.quantum_m;
    struct multi_mode mode = {multi_fit(from, &points), weight};
    mode.belief.covariance[0] += quantum * quantum;
    mode.belief.covariance[4] += quantum * quantum;
    mode.belief.covariance[8] += quantum * quantum / (NAV_NEAR_M * NAV_NEAR_M); /* the same at a whisker's tip */
    m->spare.at[m->spare.count++] = mode;
}

/* Scales weights to sum 1 and returns what the sum was. */
static double scale(double *weight, int count)
{
    double sum = 0.0;
    for (int n = 0; n < count; n++)
        sum += weight[n];
    for (int n = 0; n < count; n++)
        weight[n] /= sum;
    return sum;
}

/* The mode's points become one Gaussian or two. */
static void refit(struct multi *m, struct nav_pose from, double weight)
{
    const struct multi_points points = {m->offset, m->weight, m->points};
    if (!multi_split(&points, m->problem->settings.multi.split, m->half)) {
        add(m, from, weight);
        return;
    }
    for (int n = 0; n < m->points; n++)
        m->weight[n] -= m->half[n];
    double rest = scale(m->weight, m->points);
    add(m, from, weight * rest);
    memcpy(m->weight, m->half, (size_t)m->points * sizeof *m->weight);
    double share = scale(m->weight, m->points);
    add(m, from, weight * share);
}

static void weigh(struct multi *m, const struct multi_mode *mode, double ceiling)
{
    double best = look(m, &mode->belief), power = 1.0;
    if (!(best > -INFINITY)) /* none of its points is free */
        return;
    double weight = mode->weight * exp(evidence(m, best) - ceiling);
    for (int n = 0; effective(m, best, power) < EFFECTIVE_LEAST * m->points && n < FLATTENINGS_MOST; n++)
        power /= 2.0;
    memcpy(m->weight, m->half, (size_t)m->points * sizeof *m->weight);
    refit(m, mode->belief.mean, weight);
}

static void update(void *self, const struct nav_evidence *row)
{
    struct multi *m = self;
    const struct nav_settings *s = &m->problem->settings;
    nav_likelihood_read(m->likelihood, row);
    m->spare.count = 0;
    m->evaluations = 0;
    for (int k = 0; k < m->modes.count; k++)
        weigh(m, &m->modes.at[k], m->likelihood->ceiling);
    if (!multi_normalise(&m->spare)) /* nothing fits: keep what there is */
        return;
    struct multi_modes old = m->modes;
    m->modes = m->spare;
    m->spare = old;
    multi_prune(&m->modes, s->multi.prune);
    multi_merge(&m->modes, s->multi.merge);
}

static const struct multi_mode *heaviest(const struct multi *m)
{
    const struct multi_mode *best = &m->modes.at[0];
    for (int k = 1; k < m->modes.count; k++)
        best = m->modes.at[k].weight > best->weight ? &m->modes.at[k] : best;
    return best;
}

static void estimate(const void *self, struct nav_estimate *out)
{
    const struct multi *m = self;
    const struct multi_mode *best = heaviest(m);
    nav_gaussian_estimate(&best->belief, out);
    out->confidence *= best->weight;
    for (int i = 0; i < 9; i++)
        out->covariance[i] *= best->weight;
    for (int k = 0; k < m->modes.count; k++) {
        const struct multi_mode *mode = &m->modes.at[k];
        double d[3] = {mode->belief.mean.x - out->pose.x, mode->belief.mean.y - out->pose.y,
                       nav_wrap(mode->belief.mean.theta - out->pose.theta)};
        for (int i = 0; i < 9 && mode != best; i++)
            out->covariance[i] += mode->weight * (mode->belief.covariance[i] + d[i / 3] * d[i % 3]);
    }
    out->evaluations = out->distinct = out->touched = m->evaluations;
    out->states = m->modes.count;
    out->bytes = sizeof *m + nav_likelihood_bytes(m->likelihood) + 2 * (size_t)m->modes.room * sizeof *m->modes.at +
                 (size_t)m->points * 8 * sizeof *m->normal;
}

static long components(const void *self, struct nav_component *out, long room)
{
    const struct multi *m = self;
    long count = 0;
    for (int k = 0; k < m->modes.count; k++) {
        long from = count < room ? count : room;
        long listed = nav_gaussian_components(&m->modes.at[k].belief, out + from, room - from);
        for (long n = from; n < count + listed && n < room; n++)
            out[n].mass *= m->modes.at[k].weight;
        count += listed;
    }
    return count;
}

const struct nav_filter_ops nav_multi_filter = {.name = "multi",
                                                .create = create,
                                                .destroy = destroy,
                                                .predict = predict,
                                                .update = update,
                                                .estimate = estimate,
                                                .components = components};
