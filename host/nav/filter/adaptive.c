/* The adaptive filter: its representation is as large as the uncertainty requires.
 *
 * Pose known: a cloud of hypotheses at exact poses, as many as its spread needs. In doubt: an arena-wide histogram
 * starts and takes the rows since which the robot may have been kidnapped; the filter keeps both beliefs, weighted by
 * how well they explained those rows. Pose unknown: the histogram alone, until its mass lies in few enough cells for a
 * cloud. While there are several modes it stays active beside the cloud and sets their weights.
 * docs/methods/localisation.md describes it. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "adaptive_answer.h"
#include "adaptive_global.h"
#include "adaptive_kidnap.h"
#include "mixture.h"
#include "particle_bins.h"

/* Shares of the belief: below the first one mode is not distinguished from another; the modes of a cloud hold the
 * second of the histogram's, or others are drawn; a mode that holds the third is the only one. */
static const double SHARE_LEAST = 1e-9, KNOWN_LEAST = 0.9, ONE_MODE = 0.999;

/* Odds of a kidnap from which the arena is searched, and its inverse, from which the cloud is dropped; share of the
 * histogram that a cloud may leave out. What is left out by each is a hundredth of the belief at most. */
static const double WAKE = 0.01, SCATTERED = 0.01;

/* Prior standard deviation of the odometry's gains: as far as the benches' wheels are off
 * (tools/benches/nav/worlds.py).
 */
static const double GAIN = 0.15;

/* Nats that a cloud drawn from the histogram must have explained better than "anywhere" before it may blame the map:
 * one that was drawn around the wrong place would explain itself. */
static const double PROVEN = 300.0;

/* The particles and what it takes to draw them. */
struct adaptive_cloud {
    struct nav_particles set;
    struct nav_bins bins;
    struct nav_sample sample;
    struct nav_rng rng;
};

struct adaptive {
    const struct nav_problem *problem;
    struct nav_likelihood *likelihood;
    struct adaptive_cloud cloud;
    struct adaptive_global global;
    struct adaptive_log log;
    struct adaptive_kidnap kidnap;
    bool local, awake;            /* which of the two beliefs are held; one at least */
    bool whole;                   /* the histogram holds all belief, and the cloud the same more finely */
    int modes;                    /* of the cloud, as last given by the histogram, 0: not known */
    double share[NAV_MODES_MOST]; /* what each of them weighs */
    double odds; /* logarithm, kidnapped against local, before the rows that the histogram has gone over */
    struct nav_pending pending; /* since the last row that was read ... */
    bool pending_unknown;       /* ... and whether some of it was not reported */
    struct nav_pose answer;     /* after the last row that was read */
    long evaluations, distinct, touched;
};

static void adaptive_destroy(void *self)
{
    struct adaptive *a = self;
    adaptive_kidnap_free(&a->kidnap);
    adaptive_log_free(&a->log);
    adaptive_global_free(&a->global);
    nav_particles_free(&a->cloud.set);
    nav_bins_free(&a->cloud.bins);
    nav_likelihood_free(a->likelihood);
    free(a);
}

/* Log-odds that the robot is not where the local belief has it. */
static double adaptive_log_odds(const struct adaptive *a)
{
    double hazard = log(a->problem->settings.motion.hazard);
    if (!a->local)
        return INFINITY;
    bool searched = a->awake && !a->whole;
    if (searched && adaptive_global_current(&a->global, &a->log))
        return a->odds + a->global.gained;
    return (searched ? a->odds : hazard) + a->kidnap.ratio;
}

static double adaptive_kidnap_probability(const struct adaptive *a)
{
    return 1.0 / (1.0 + exp(-adaptive_log_odds(a)));
}

static struct nav_pose adaptive_ahead(const struct adaptive *a)
{
    return adaptive_log_since(&a->log, a->global.next).step;
}

/* Whether the histogram holds what the local belief does not. */
static bool adaptive_two(const struct adaptive *a)
{
    return a->awake && !(a->whole && a->local);
}

static struct adaptive_held adaptive_hold(const struct adaptive *a)
{
    double share = adaptive_kidnap_probability(a);
    bool two = adaptive_two(a);
    return (struct adaptive_held){.problem = a->problem,
                                  .local = a->local ? &a->cloud.set : NULL,
                                  .global = two ? &a->global : NULL,
                                  .log = &a->log,
                                  .share = two || share > WAKE ? share : 0.0};
}

static void adaptive_sum_up(struct adaptive *a)
{
    struct adaptive_held held = adaptive_hold(a);
    a->answer = adaptive_answer_pose(&held, &a->cloud.bins, a->answer);
}

/* Draws the particles from the prior; false when nothing of it is free. */
static bool adaptive_begin_cloud(struct adaptive *a)
{
    struct adaptive_cloud *cloud = &a->cloud;
    return nav_particles_begin(&cloud->set, &cloud->bins, a->likelihood, &a->problem->prior, 0.0, &cloud->rng,
                               &cloud->sample);
}

/* A mixture that a cloud can hold: in doubt from the start, by the share that it may be wrong. A wider one: unknown. */
static void adaptive_begin_mixture(struct adaptive *a)
{
    bool few = adaptive_global_fill(&a->global) * ADAPTIVE_PER_BIN <= a->global.room;
    a->local = few && adaptive_begin_cloud(a);
    if (a->local)
        adaptive_global_restart(&a->global, 0);
    a->awake = true;
    a->odds = log(NAV_ANYWHERE / (1.0 - NAV_ANYWHERE));
    a->answer = nav_mixture_prior(a->problem).mean;
    adaptive_sum_up(a);
}

static void adaptive_begin(struct adaptive *a)
{
    if (nav_mixture_given(&a->problem->prior)) {
        adaptive_begin_mixture(a);
        return;
    }
    a->local = !a->problem->prior.uniform && adaptive_begin_cloud(a);
    a->awake = !a->local;
    a->kidnap.proven = a->local ? (double)INFINITY : 0.0; /* a start that is given */
    a->answer = nav_mixture_prior(a->problem).mean;
    adaptive_sum_up(a);
}

static int adaptive_init_cloud(struct adaptive *a)
{
    const struct nav_settings *s = &a->problem->settings;
    struct adaptive_cloud *cloud = &a->cloud;
    cloud->sample.error = 0.5 / ADAPTIVE_PER_BIN; /* many bins: twice the error by the bins, less 1 (Fox) */
    cloud->sample.most = (long)a->global.room;
    cloud->sample.least = (long)fmin(s->adaptive.least, a->global.room);
    nav_rng_seed(&cloud->rng, a->problem->seed, 0);
    return nav_particles_init(&cloud->set, cloud->sample.most, true, GAIN) ||
                   nav_bins_init(&cloud->bins, cloud->sample.most, a->global.cell.edge / 2.0,
                                 a->global.cell.heading / 2.0)
               ? -1
               : 0;
}

static void *adaptive_create(const struct nav_problem *problem)
{
    struct adaptive *a = calloc(1, sizeof *a);
    struct nav_rng rng;
    if (!a)
        return NULL;
    a->problem = problem;
    nav_rng_seed(&rng, problem->seed, 1);
    a->likelihood = nav_likelihood_new(&problem->arena, &problem->robot, &problem->settings, 0.0);
    if (!a->likelihood || adaptive_global_init(&a->global, problem, &a->likelihood->ground) || adaptive_init_cloud(a) ||
        adaptive_log_init(&a->log, &a->likelihood->sensors) || adaptive_kidnap_init(&a->kidnap, a->likelihood, &rng)) {
        adaptive_destroy(a);
        return NULL;
    }
    adaptive_begin(a);
    return a;
}

/* Wakes the histogram at the row since which the robot may have been kidnapped. */
static void adaptive_start_search(struct adaptive *a)
{
    uint64_t reach = adaptive_log_reach(&a->log);
    a->awake = true;
    a->modes = a->whole ? a->modes : 0;
    a->whole = false;
    adaptive_kidnap_teach(&a->kidnap, a->likelihood, a->global.likelihood);
    a->odds = log(a->problem->settings.motion.hazard);
    adaptive_global_restart(&a->global, a->kidnap.since > reach ? a->kidnap.since : reach);
}

static void adaptive_stop_search(struct adaptive *a)
{
    a->awake = a->whole = false;
    a->modes = 0;
    adaptive_kidnap_clear(&a->kidnap, a->likelihood, a->log.head);
}

/* The first hypotheses, which the histogram knows nothing of, go to it: it then holds all belief, not just `share`. */
static void adaptive_give_particles(struct adaptive *a, long count, double share)
{
    for (long n = 0; n < count; n++)
        adaptive_global_add(&a->global, nav_particles_pose(&a->cloud.set, n), (double)a->cloud.set.weight[n] / share);
    adaptive_global_added(&a->global);
}

/* Draws as many particles as the spread needs when the weights have become uneven, or always when `force`. */
static void adaptive_resample(struct adaptive *a, bool force)
{
    struct adaptive_cloud *cloud = &a->cloud;
    if (!force && 2.0 * nav_particles_effective(&cloud->set) >= (double)cloud->set.count)
        return;
    nav_bins_fill(&cloud->bins, &cloud->set);
    long count = nav_bins_needed(&cloud->bins, &cloud->sample, 0.0);
    a->touched += cloud->set.count;
    nav_particles_resample(&cloud->set, count, nav_rng_uniform(&cloud->rng));
}

/* The histogram's mass sits in few cells: hypotheses take over its share. */
static void adaptive_draw_particles(struct adaptive *a, double share)
{
    const struct nav_settings *s = &a->problem->settings;
    double count = fmin(fmax(s->adaptive.least, a->global.crowd * ADAPTIVE_PER_BIN), a->global.room / 2.0);
    struct nav_particles *set = &a->cloud.set;
    long held = a->local ? set->count : 0, left = set->room - (long)count;
    if (held > left) { /* a full cloud would have no room for what was found */
        held = left;
        nav_particles_resample(set, held, nav_rng_uniform(&a->cloud.rng));
    }
    set->count = held;
    nav_particles_scale(set, 1.0 - share);
    adaptive_global_draw(&a->global, set, &a->cloud.rng, (long)count, share, adaptive_ahead(a));
    adaptive_give_particles(a, held, share);
    if (a->local && share > 0.5) { /* what contradicted the local belief was not the whiskers' fault, nor the map's */
        adaptive_kidnap_teach(&a->kidnap, a->likelihood, a->likelihood);
        nav_map_forget(a->likelihood);
    }
    if (!a->local || share > 0.5)
        a->kidnap.proven = 0.0;
    a->local = true;
    a->touched += set->count;
    adaptive_resample(a, true);
    a->whole = true;
    a->modes = 0;
    adaptive_kidnap_clear(&a->kidnap, a->likelihood, a->log.head);
}

/* Gives the modes of the cloud the shares that the histogram gave last. */
static void adaptive_keep_shares(struct adaptive *a)
{
    double factor[NAV_MODES_MOST], mass[NAV_MODES_MOST];
    nav_particles_masses(&a->cloud.set, mass, a->modes);
    for (int m = 0; m < a->modes; m++)
        factor[m] = a->share[m] / fmax(mass[m], SHARE_LEAST);
    nav_particles_weigh_modes(&a->cloud.set, factor, a->modes);
}

/* Nothing was found in the rest of the arena: where there were several modes the histogram holds the cloud's again. */
static void adaptive_keep_particles(struct adaptive *a)
{
    if (a->modes < 2) {
        adaptive_stop_search(a);
        return;
    }
    adaptive_global_clear(&a->global, a->log.head);
    for (long n = 0; n < a->cloud.set.count; n++)
        adaptive_global_add(&a->global, nav_particles_pose(&a->cloud.set, n), (double)a->cloud.set.weight[n]);
    adaptive_global_added(&a->global);
    a->whole = true;
    adaptive_kidnap_clear(&a->kidnap, a->likelihood, a->log.head);
}

/* Hypotheses are too few to estimate the weights of several modes: the histogram does. It stops when one is left, draws
 * them anew where it holds more than they do, and begins again from them where it has lost what they hold: its cells
 * are coarse, and a robot may stand where all of them are blocked. */
static void adaptive_weigh_modes(struct adaptive *a)
{
    struct nav_mode mode[NAV_MODES_MOST];
    double share[NAV_MODES_MOST], known = 0.0, most = 0.0;
    int modes = nav_particles_modes(&a->cloud.set, mode);
    adaptive_global_share(&a->global, mode, modes, share);
    for (int m = 0; m < modes; m++) {
        known += share[m];
        most = fmax(most, share[m]);
    }
    if (known >= KNOWN_LEAST) {
        a->modes = modes;
        memcpy(a->share, share, sizeof a->share);
        adaptive_keep_shares(a);
        if (most > ONE_MODE)
            adaptive_stop_search(a);
    } else if (a->global.scattered < SCATTERED) {
        a->local = false;
        adaptive_draw_particles(a, 1.0);
    } else {
        adaptive_keep_particles(a);
    }
}

/* The robot is not where the cloud has it, and never was where that learned of the map. */
static void adaptive_drop_particles(struct adaptive *a)
{
    a->local = false;
    nav_map_forget(a->likelihood);
}

/* Ends a search that has gone over all rows: what it found is drawn, or there was nothing in the rest of the arena, or
 * the cloud is wrong. */
static void adaptive_end_search(struct adaptive *a, double present)
{
    if (a->global.scattered < SCATTERED && present > log(WAKE))
        adaptive_draw_particles(a, adaptive_kidnap_probability(a));
    else if (a->kidnap.ratio <= 0.0 && present <= log(WAKE))
        adaptive_keep_particles(a);
    else if (present > -log(WAKE))
        adaptive_drop_particles(a);
}

static void adaptive_decide(struct adaptive *a)
{
    double present = adaptive_log_odds(a);
    bool kidnapped = present > log(WAKE), shared = a->whole && a->local;
    if (!a->awake ? kidnapped
                  : shared && present > 0.0) /* a search of the whole arena costs what is known of the modes */
        adaptive_start_search(a);
    else if (!a->awake || !adaptive_global_current(&a->global, &a->log))
        return;
    else if (shared)
        adaptive_weigh_modes(a);
    else
        adaptive_end_search(a, present);
}

static void adaptive_search(struct adaptive *a)
{
    adaptive_global_work(&a->global, &a->log, a->local ? 0.0 : a->problem->settings.motion.hazard);
    a->touched += a->global.touched;
    a->evaluations += a->global.touched;
    a->distinct += a->global.distinct;
}

/* NAV_CARRIED of the belief is anywhere from here on: the histogram begins anew beside what is held locally. */
static void adaptive_carry(struct adaptive *a)
{
    double away = 1.0 - (1.0 - adaptive_kidnap_probability(a)) * (1.0 - NAV_CARRIED);
    adaptive_kidnap_clear(&a->kidnap, a->likelihood, a->log.head);
    adaptive_start_search(a);
    a->odds = log(away) - log1p(-away);
    adaptive_sum_up(a);
}

static void adaptive_predict(void *self, const struct nav_motion *motion)
{
    struct adaptive *a = self;
    a->evaluations = a->distinct = a->touched = 0;
    struct nav_noise noise = nav_motion_noise(&a->problem->robot, &a->problem->settings, motion);
    nav_pending_add(&a->pending, motion->step, noise);
    a->pending_unknown = a->pending_unknown || motion->unknown_m > 0.0 || motion->unknown_rad > 0.0;
    if (motion->carried)
        adaptive_carry(a);
}

/* Moves the hypotheses and weighs them; returns the row's log-likelihood. */
static double adaptive_take_cloud(struct adaptive *a)
{
    struct nav_particles *set = &a->cloud.set;
    double mass = 1.0 - adaptive_kidnap_probability(a);
    a->touched += 2 * set->count;
    a->evaluations += set->count;
    a->distinct += set->count;
    nav_particles_move(set, a->pending.step, &a->pending.noise, !a->pending_unknown, &a->cloud.rng);
    double local = nav_particles_weigh(set, a->likelihood, mass);
    if (a->awake && a->modes > 1)
        adaptive_keep_shares(a);
    return local;
}

static void adaptive_doubt(struct adaptive *a, const double *moved, double local)
{
    uint64_t row = a->log.head - 1;
    double anywhere = adaptive_kidnap_anywhere(&a->kidnap, a->likelihood, moved);
    adaptive_log_entry(&a->log, row)->local = local;
    adaptive_kidnap_take(&a->kidnap, a->likelihood, row, anywhere, local);
}

static void adaptive_learn(struct adaptive *a)
{
    if (!a->whole && a->kidnap.proven > PROVEN)
        nav_map_learn(a->likelihood);
    nav_trust_learn(a->likelihood);
}

/* After a motion that was not reported more poses are possible than the cloud has room for: the histogram holds them.
 */
static void adaptive_hand_over(struct adaptive *a)
{
    const struct nav_bins *bins = &a->cloud.bins; /* in 4 deviations: */
    double across = 1.0 + 4.0 * sqrt(a->pending.noise.position) / bins->edge;
    double turned = 1.0 + 4.0 * sqrt(a->pending.noise.heading) * bins->turns / (2.0 * NAV_PI);
    if (!a->pending_unknown || !a->local || (a->awake && !a->whole) ||
        across * across * turned * ADAPTIVE_PER_BIN <= a->global.room)
        return;
    adaptive_global_clear(&a->global, a->log.head);
    adaptive_give_particles(a, a->cloud.set.count, 1.0);
    a->local = a->whole = false;
    a->awake = true;
    a->modes = 0;
}

/* Takes what came with a row: its motion, and what its readings would be worth anywhere. */
static void adaptive_read(struct adaptive *a, const struct nav_evidence *evidence)
{
    nav_likelihood_read(a->likelihood, evidence);
    adaptive_log_write(&a->log, a->pending.step, a->pending.noise, evidence, a->likelihood->unknown);
    a->answer = nav_compose(a->answer, a->pending.step);
}

/* The algorithm; numbers are of the equations in docs/methods/localisation.md. */
static void adaptive_update(void *self, const struct nav_evidence *evidence)
{
    struct adaptive *a = self;
    adaptive_hand_over(a);      /* motion unknown, poses too many for a cloud: to the histogram */
    adaptive_read(a, evidence); /* 3: likelihoods of the readings by what may be expected */
    if (a->local) {
        double local = adaptive_take_cloud(a);     /* 2, 1: moves and weighs the cloud */
        adaptive_doubt(a, evidence->moved, local); /* 5: odds of a kidnap, by "anywhere" */
        adaptive_learn(a);                         /* 4: trust, and where the map is wrong */
        adaptive_resample(a, false);               /* as many hypotheses as the cloud's spread asks for */
    }
    if (a->awake)
        adaptive_search(a); /* 1 to 3, 5: the same of the histogram */
    adaptive_decide(a);     /* 5: wakes the histogram, draws a cloud from it, drops either */
    adaptive_sum_up(a);     /* 6: the answer */
    a->pending = (struct nav_pending){.step = {0.0, 0.0, 0.0}};
    a->pending_unknown = false;
}

static void adaptive_estimate(const void *self, struct nav_estimate *out)
{
    const struct adaptive *a = self;
    struct adaptive_held held = adaptive_hold(a);
    adaptive_answer_estimate(&held, a->answer, &a->pending, out);
    out->evaluations = a->evaluations;
    out->distinct = a->distinct;
    out->touched = a->touched;
    out->states = a->local ? a->cloud.set.count : 0;
    out->states += a->awake ? (long)adaptive_global_cells(&a->global) : 0;
    out->bytes = sizeof *a + nav_likelihood_bytes(a->likelihood) + adaptive_global_bytes(&a->global) +
                 adaptive_log_bytes(&a->log) + nav_particles_bytes(&a->cloud.set) + nav_bins_bytes(&a->cloud.bins);
}

static long adaptive_components(const void *self, struct nav_component *out, long room)
{
    const struct adaptive *a = self;
    struct adaptive_held held = adaptive_hold(a);
    return adaptive_answer_list(&held, a->answer, &a->pending, out, room);
}

static struct nav_resolution adaptive_resolution(const void *self)
{
    const struct adaptive_global *g = &((const struct adaptive *)self)->global;
    const struct nav_shape finest = nav_levels_shape(&g->histogram.levels, 0);
    return (struct nav_resolution){finest.cell, finest.cell_theta, g->cell.edge, g->first.too_wide};
}

const struct nav_filter_ops nav_adaptive_filter = {.name = "adaptive",
                                                   .create = adaptive_create,
                                                   .destroy = adaptive_destroy,
                                                   .predict = adaptive_predict,
                                                   .update = adaptive_update,
                                                   .estimate = adaptive_estimate,
                                                   .components = adaptive_components,
                                                   .resolution = adaptive_resolution};
