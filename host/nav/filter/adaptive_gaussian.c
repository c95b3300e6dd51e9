#include "adaptive_gaussian.h"

#include <math.h>

/* Corners of two icosahedra, equally weighted: their moments are the standard normal's up to the fifth. */
enum { CORNERS = 12, POINTS = 2 * CORNERS };
static const double RADIUS[] = {0.7419637843, 2.3344142183}; /* roots of 3 -+ root of 6 */

/* The wider Gaussian is so many times as wide. */
static const double WIDER = 4.0;

/* Rows that fade, that a comparison takes, and that pass until the next when one has failed. */
enum { KEPT = 64, COMPARED = 128, PAUSE = 256 };

/* Nats: odds of twenty to one, which is also the most information of recent rows while it is compared; and what they
 * may while it carries. */
static const double SURE = 3.0, TOLD_MOST = 5.0;

/* Log-likelihood of a row where the robot could stand at no point. */
static const double BLOCKED = -3.0;

int adaptive_gaussian_init(struct adaptive_gaussian *g, const struct nav_problem *problem,
                           struct nav_likelihood *likelihood)
{
    *g = (struct adaptive_gaussian){.reported = 0.0};
    return nav_kalman_init(&g->kalman, problem, likelihood);
}

void adaptive_gaussian_free(struct adaptive_gaussian *g)
{
    nav_borders_free(&g->kalman.borders);
}

void adaptive_gaussian_begin(struct adaptive_gaussian *g, const struct nav_gaussian *belief)
{
    g->kalman.belief = *belief;
    g->reported = g->wider = g->behind = 0.0;
    g->compared = 0;
}

/* Corner n of both: (0, +-1, +-phi) in turn about the axes. */
static void gaussian_corner(int n, double scale, double z[3])
{
    static const double SHORT = 0.5257311121, LONG = 0.8506508084;
    double radius = scale * RADIUS[n / CORNERS];
    z[n % 3] = 0.0;
    z[(n + 1) % 3] = n / 3 & 1 ? -radius * SHORT : radius * SHORT;
    z[(n + 2) % 3] = n / 3 & 2 ? -radius * LONG : radius * LONG;
}

/* Log-likelihoods of the row at those corners of a Gaussian `scale` times as wide where the robot can stand; returns
 * how many. mass: as nav_particles_weigh. */
static int gaussian_look_up(const struct adaptive_gaussian *g, double scale, double mass, double *loglik)
{
    struct nav_likelihood *l = g->kalman.likelihood;
    const struct nav_gaussian *belief = &g->kalman.belief;
    double root[9], z[3];
    int free = 0;
    nav_gaussian_root(belief->covariance, root);
    for (int n = 0; n < POINTS; n++) {
        gaussian_corner(n, scale, z);
        struct nav_pose pose = nav_gaussian_at(belief, root, z);
        const struct nav_place at = {pose.x, pose.y, (double)cosf((float)pose.theta), (double)sinf((float)pose.theta)};
        if (!nav_likelihood_clear(l, at.x, at.y, 0.0))
            continue;
        loglik[free++] = (double)nav_likelihood_at(l, &at, l->scratch);
        if (mass < 0.0)
            continue;
        nav_trust_add(l, l->scratch, mass / POINTS);
        nav_map_add(l, &at, l->scratch, 1.0 / POINTS);
    }
    return free;
}

/* Log of the row's mean likelihood at those points, and its information about them: the divergence of their weights
 * from equal ones. */
static double gaussian_weigh(const struct adaptive_gaussian *g, double scale, double mass, double *reported)
{
    double loglik[POINTS], best = -INFINITY, sum = 0.0, product = 0.0;
    int free = gaussian_look_up(g, scale, mass, loglik);
    *reported = 0.0;
    if (free == 0)
        return BLOCKED;
    for (int n = 0; n < free; n++)
        best = fmax(best, loglik[n]);
    for (int n = 0; n < free; n++) {
        double likelihood = exp(loglik[n] - best);
        sum += likelihood;
        product += likelihood * (loglik[n] - best);
    }
    *reported = fmax(product / sum + log(free / sum), 0.0);
    return best + log(sum / free);
}

double adaptive_gaussian_take(struct adaptive_gaussian *g, const struct nav_pending *pending,
                              const struct nav_evidence *evidence, double mass)
{
    double own = 0.0, wider, reported, unused;
    g->looked = 0;
    nav_kalman_move(&g->kalman, pending->step, &pending->noise);
    if (g->carries || g->compared > 0) {
        if (mass >= 0.0) {
            nav_trust_begin(g->kalman.likelihood);
            nav_map_begin(g->kalman.likelihood);
        }
        own = gaussian_weigh(g, 1.0, mass, &reported);
        wider = gaussian_weigh(g, WIDER, -1.0, &unused);
        g->reported += reported - g->reported / KEPT;
        g->wider = fmax(g->wider + wider - own, 0.0);
        g->looked = 2 * POINTS;
    }
    nav_kalman_take(&g->kalman, evidence);
    g->looked += g->kalman.evaluations;
    return own;
}

bool adaptive_gaussian_fails(const struct adaptive_gaussian *g)
{
    return g->reported > (g->carries ? TOLD_MOST : SURE) || g->wider > SURE;
}

bool adaptive_gaussian_compare(struct adaptive_gaussian *g, double particles, double own)
{
    g->behind += particles - own;
    g->compared++;
    if (g->behind > SURE || adaptive_gaussian_fails(g))
        g->compared = -PAUSE;
    return g->compared > COMPARED;
}

void adaptive_gaussian_draw(const struct adaptive_gaussian *g, struct nav_particles *to, struct nav_rng *rng,
                            long count)
{
    double scale = g->wider > SURE ? WIDER : 1.0, root[9];
    long all = (long)fmin(scale * (double)count, (double)to->room);
    nav_gaussian_root(g->kalman.belief.covariance, root);
    to->count = 0;
    for (long n = 0; n < all; n++) {
        double z[3];
        for (int k = 0; k < 3; k++)
            z[k] = scale * nav_rng_normal(rng);
        nav_particles_add(to, nav_gaussian_at(&g->kalman.belief, root, z), 1.0 / (double)all, rng);
    }
}
