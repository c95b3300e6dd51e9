#include "weigh.h"

#include <math.h>
#include <stdlib.h>

#include "intake.h"
#include "likelihood.h"

struct nav_weigher {
    const struct nav_problem *problem;
    struct nav_intake intake;
    struct nav_likelihood *likelihood;
    bool news;
};

struct nav_weigher *nav_weigher_new(const struct nav_problem *problem)
{
    struct nav_weigher *w = calloc(1, sizeof *w);
    if (!w)
        return NULL;
    w->problem = problem;
    w->likelihood = nav_likelihood_new(&problem->arena, &problem->robot, &problem->settings, 0.0);
    if (nav_intake_init(&w->intake, problem) || !w->likelihood) {
        nav_weigher_free(w);
        return NULL;
    }
    return w;
}

void nav_weigher_free(struct nav_weigher *w)
{
    if (!w)
        return;
    nav_intake_free(&w->intake);
    nav_likelihood_free(w->likelihood);
    free(w);
}

bool nav_weigher_take(struct nav_weigher *w, const struct nav_row *row, double out[5])
{
    struct nav_motion motion;
    struct nav_evidence evidence;
    w->news = nav_intake_take(&w->intake, row, &motion, &evidence);
    if (w->news)
        nav_likelihood_read(w->likelihood, &evidence);
    struct nav_noise noise = nav_motion_noise(&w->problem->robot, &w->problem->settings, &motion);
    out[0] = motion.step.x;
    out[1] = motion.step.y;
    out[2] = motion.step.theta;
    out[3] = sqrt(noise.position);
    out[4] = sqrt(noise.heading);
    return w->news;
}

void nav_weigher_weigh(const struct nav_weigher *w, const double *poses, long n, double *loglik)
{
    for (long i = 0; i < n; i++) {
        double x = poses[3 * i], y = poses[3 * i + 1], theta = poses[3 * i + 2];
        if (w->news)
            loglik[i] = nav_likelihood_standing(w->likelihood, &(struct nav_place){x, y, cos(theta), sin(theta)});
        else
            loglik[i] = nav_likelihood_clear(w->likelihood, x, y, 0.0) ? 0.0 : -INFINITY;
    }
}

double nav_weigher_ceiling(const struct nav_weigher *w)
{
    return w->news ? w->likelihood->ceiling : 0.0;
}
