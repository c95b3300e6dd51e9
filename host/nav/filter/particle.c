/* Monte-Carlo localisation: systematic resampling, a fixed or KLD-adapted number of particles, and recovery by
 * injection.
 *
 * Injection follows Thrun, Burgard and Fox (augmented MCL): the share of fresh particles is how far a fast average of
 * the mean weight lies below a slow one. Both take the weights before they are normalised (afterwards their mean is 1/N
 * whatever is read), relative to the best that a row could have scored, so that rows with more whiskers compare. Fresh
 * particles are drawn where the present row is likely (sensor resetting): one that does not fit at all helps nobody. */
#include "filter.h"
#include "particle_bins.h"

#include <math.h>
#include <stdlib.h>

#include "gaussian.h"

enum { CANDIDATES = 8 };
/* Particles: at least as many as give one compact mode's spread to 4 % (1 / sqrt(2 n)), at most 1 MB of them. Their
 * belief's divergence (Kullback-Leibler) exceeds the error once in a hundred rows (Fox). They are resampled when worth
 * fewer than half of them (Doucet), and the fast average follows the weights ten times as fast as the slow one. */
enum { LEAST = 300, MOST = 20000 };
static const double ERROR = 0.05, RESAMPLED = 0.5, FASTER = 10.0;
static const double FRESH_MOST = 0.5; /* share of the particles that may be fresh in one row */
/* A run of bad windows lowers the fast average, too: it must fall to the slow one's 1 / MARGIN before anything is done.
 */
static const double MARGIN = 2.0;
/* Motion is put off while nothing is read, but not beyond this: headings that differ then fan out. */
static const double PENDING_MOST_M = 0.05, PENDING_MOST_RAD = 0.2;

struct particle {
    const struct nav_problem *problem;
    struct nav_likelihood *likelihood;
    struct nav_particles cloud;
    struct nav_bins bins;
    struct nav_rng rng;
    struct nav_sample sample;
    double slow, fast; /* averages of the mean weight; negative before the first row */
    struct nav_pending pending;
    struct nav_pose mean; /* near the last one or near the heaviest part, without what is pending */
    long weighed, moved;  /* for the last row */
};

static void particle_destroy(void *self)
{
    struct particle *f = self;
    nav_likelihood_free(f->likelihood);
    nav_particles_free(&f->cloud);
    nav_bins_free(&f->bins);
    free(f);
}

static void particle_summarise(struct particle *f)
{
    f->mean = nav_particles_summary(&f->cloud, &f->bins, f->mean).mean;
}

static void *particle_create(const struct nav_problem *problem)
{
    const struct nav_settings *s = &problem->settings;
    struct particle *f = calloc(1, sizeof *f);
    if (!f)
        return NULL;
    *f = (struct particle){.problem = problem, .slow = -1.0, .fast = -1.0};
    long count = (long)fmax(s->particle.count, 2.0);
    f->sample =
        s->particle.count > 0.0 ? (struct nav_sample){ERROR, count, count} : (struct nav_sample){ERROR, LEAST, MOST};
    nav_rng_seed(&f->rng, problem->seed, 0);
    f->likelihood = nav_likelihood_new(&problem->arena, &problem->robot, s, 0.0);
    struct nav_cell bin = {.edge = 0.0};
    if (f->likelihood)
        bin = nav_sensors_cell(&f->likelihood->sensors, 0.0);
    if (!f->likelihood || nav_particles_init(&f->cloud, f->sample.most, false, 0.0) ||
        nav_bins_init(&f->bins, f->sample.most, bin.edge, bin.heading)) {
        particle_destroy(f);
        return NULL;
    }
    nav_particles_begin(&f->cloud, &f->bins, f->likelihood, &problem->prior, NAV_ANYWHERE, &f->rng, &f->sample);
    f->mean = nav_particles_pose(&f->cloud, 0);
    particle_summarise(f);
    return f;
}

static void particle_catch_up(struct particle *f)
{
    nav_particles_move(&f->cloud, f->pending.step, &f->pending.noise, true, &f->rng);
    f->mean = nav_compose(f->mean, f->pending.step);
    f->pending = (struct nav_pending){.step = {0.0, 0.0, 0.0}};
    f->moved += f->cloud.count;
}

/* NAV_CARRIED of the belief is anywhere: drawn among as many as there may be. */
static void particle_carry(struct particle *f)
{
    const struct nav_prior anywhere = {.uniform = true};
    struct nav_pose pose;
    particle_catch_up(f);
    nav_particles_resample(&f->cloud, f->sample.most, nav_rng_uniform(&f->rng));
    for (long n = 0; n < f->cloud.count; n++) {
        if (nav_rng_uniform(&f->rng) < NAV_CARRIED && nav_particles_draw(f->likelihood, &anywhere, 1.0, &f->rng, &pose))
            nav_particles_set(&f->cloud, n, pose);
    }
    f->moved += f->cloud.count;
    f->slow = f->fast = -1.0;
    particle_summarise(f);
}

static void particle_predict(void *self, const struct nav_motion *motion)
{
    struct particle *f = self;
    struct nav_noise noise = nav_motion_noise(&f->problem->robot, &f->problem->settings, motion);
    f->moved = f->weighed = 0;
    nav_pending_add(&f->pending, motion->step, noise);
    if (hypot(f->pending.step.x, f->pending.step.y) > PENDING_MOST_M ||
        fabs(f->pending.step.theta) > PENDING_MOST_RAD) {
        particle_catch_up(f);
        particle_summarise(f);
    }
    if (motion->carried)
        particle_carry(f);
}

/* Share of fresh particles that the weights' decline asks for. */
static double particle_decline(struct particle *f, double mean_weight)
{
    const struct nav_settings *s = &f->problem->settings;
    if (!(s->particle.recovery > 0.0))
        return 0.0;
    if (f->slow < 0.0)
        f->slow = f->fast = mean_weight;
    f->slow += s->particle.recovery * (mean_weight - f->slow);
    f->fast += FASTER * s->particle.recovery * (mean_weight - f->fast);
    double share = f->slow > 0.0 ? 1.0 - MARGIN * f->fast / f->slow : 0.0;
    return fmin(fmax(share, 0.0), FRESH_MOST);
}

static struct nav_pose particle_draw_fresh(struct particle *f)
{
    const struct nav_prior anywhere = {.uniform = true};
    struct nav_pose pose;
    for (int n = 0; n < CANDIDATES; n++) {
        nav_particles_draw(f->likelihood, &anywhere, 1.0, &f->rng, &pose);
        double loglik = nav_likelihood_standing(f->likelihood,
                                                &(struct nav_place){pose.x, pose.y, cos(pose.theta), sin(pose.theta)});
        f->weighed++;
        if (log(1.0 - nav_rng_uniform(&f->rng)) <= loglik - f->likelihood->ceiling)
            break;
    }
    return pose;
}

static void particle_resample(struct particle *f, double fresh)
{
    nav_bins_fill(&f->bins, &f->cloud);
    long count = nav_bins_needed(&f->bins, &f->sample, fresh);
    nav_particles_resample(&f->cloud, count, nav_rng_uniform(&f->rng));
    /* Every k-th particle gives way, so that what is drawn in order of the old cloud loses the same share throughout.
     */
    double step = fresh > 0.0 ? 1.0 / fresh : INFINITY;
    for (double at = step * nav_rng_uniform(&f->rng); at < (double)count; at += step)
        nav_particles_set(&f->cloud, (long)at, particle_draw_fresh(f));
    f->moved += count;
}

static void particle_update(void *self, const struct nav_evidence *evidence)
{
    struct particle *f = self;
    particle_catch_up(f);
    nav_likelihood_read(f->likelihood, evidence);
    f->weighed = f->cloud.count;
    double mean = exp(nav_particles_weigh(&f->cloud, f->likelihood, -1.0) - f->likelihood->ceiling);
    double fresh = particle_decline(f, mean);
    bool uneven = nav_particles_effective(&f->cloud) < RESAMPLED * (double)f->cloud.count;
    particle_summarise(f);
    if (uneven || fresh > 0.0)
        particle_resample(f, fresh);
    if (fresh > 0.0) /* another belief than was summarised */
        particle_summarise(f);
}

static void particle_estimate(const void *self, struct nav_estimate *out)
{
    const struct particle *f = self;
    out->pose = nav_compose(f->mean, f->pending.step);
    out->pose.theta = nav_wrap(out->pose.theta);
    nav_particles_covariance(&f->cloud, &f->pending, out->pose, out->covariance);
    out->confidence = nav_particles_within(&f->cloud, f->mean, &f->pending, out->pose);
    out->evaluations = out->distinct = f->weighed;
    out->touched = f->weighed + f->moved;
    out->states = f->cloud.count;
    out->bytes =
        sizeof *f + nav_particles_bytes(&f->cloud) + nav_bins_bytes(&f->bins) + nav_likelihood_bytes(f->likelihood);
}

static long particle_components(const void *self, struct nav_component *out, long room)
{
    const struct particle *f = self;
    return nav_particles_components(&f->cloud, f->mean, &f->pending, 1.0, out, room);
}

const struct nav_filter_ops nav_particle_filter = {.name = "particle",
                                                   .create = particle_create,
                                                   .destroy = particle_destroy,
                                                   .predict = particle_predict,
                                                   .update = particle_update,
                                                   .estimate = particle_estimate,
                                                   .components = particle_components};
