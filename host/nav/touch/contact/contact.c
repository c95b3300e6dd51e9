#include "contact.h"

#include <math.h>

/* A deflection between the thresholds for so many samples is drift: this share of rest_samples, ... */
#define LINGER 0.025
#define RINGING 4.0 /* ... but not what rings: at least so many times release_samples */

void nav_contact_init(struct nav_contact *c, const struct nav_contact_config *config)
{
    *c = (struct nav_contact){.config = *config};
}

static void contact_settle(struct nav_contact *c, double alpha, double beta)
{
    c->settled++;
    c->rest[0] += (alpha - c->rest[0]) / c->settled;
    c->rest[1] += (beta - c->rest[1]) / c->settled;
}

/* Only samples below the release threshold move the rest: what presses softly must not become the new rest at once. */
static void contact_follow_drift(struct nav_contact *c, double alpha, double beta)
{
    double share = c->config.rest_samples > 1.0 ? 1.0 / c->config.rest_samples : 0.0;
    c->rest[0] += share * (alpha - c->rest[0]);
    c->rest[1] += share * (beta - c->rest[1]);
}

/* Counts the samples between the thresholds, downwards below them: noise takes single samples across. true: so many
 * that it is drift. Contacts cross in milliseconds; drift faster than the rest follows stays. */
static bool contact_lingers(struct nav_contact *c, double deflection)
{
    double longest = fmax(LINGER * c->config.rest_samples, RINGING * c->config.release_samples);
    bool between = deflection >= c->config.release_counts && deflection <= c->config.onset_counts;
    if (between)
        c->between = fmin(c->between + 1.0, longest);
    else if (deflection < c->config.release_counts)
        c->between = fmax(c->between - 1.0, 0.0);
    return between && c->config.rest_samples > 1.0 && c->between >= longest;
}

/* Draws the rest after the sample until it is deflected by no more than the release threshold. That takes a
 * soft press for drift by the difference of the thresholds at most; it is below the release threshold, so that nothing
 * is felt when the press ends, and the rest comes back. */
static void contact_draw_after(struct nav_contact *c, double alpha, double beta, double deflection)
{
    double share = 1.0 - c->config.release_counts / deflection;
    c->rest[0] += share * (alpha - c->rest[0]);
    c->rest[1] += share * (beta - c->rest[1]);
}

static enum nav_contact_event contact_begin_or_wait(struct nav_contact *c, double deflection)
{
    if (!(deflection > c->config.onset_counts)) {
        c->run = 0;
        return NAV_CONTACT_NONE;
    }
    c->run_peak = c->run == 0 ? deflection : fmax(c->run_peak, deflection);
    if (++c->run < c->config.onset_samples)
        return NAV_CONTACT_NONE;
    c->run = 0;
    c->between = 0.0;
    c->touching = true;
    c->peak = c->run_peak;
    return NAV_CONTACT_ONSET;
}

/* A contact also ends when what is left of it lingers: the rest has drifted meanwhile. */
static enum nav_contact_event contact_end_or_stay(struct nav_contact *c, double deflection)
{
    c->peak = fmax(c->peak, deflection);
    bool drifted = contact_lingers(c, deflection);
    c->run = deflection < c->config.release_counts ? c->run + 1 : 0;
    if (!drifted && c->run < c->config.release_samples)
        return NAV_CONTACT_NONE;
    c->run = 0;
    c->touching = false;
    return NAV_CONTACT_RELEASE;
}

enum nav_contact_event nav_contact_update(struct nav_contact *c, double alpha, double beta, bool good)
{
    if (!good || !isfinite(alpha) || !isfinite(beta)) {
        c->skipped++;
        return NAV_CONTACT_NONE;
    }
    if (c->settled < c->config.settle_samples) {
        contact_settle(c, alpha, beta);
        return NAV_CONTACT_NONE;
    }
    double deflection = hypot(alpha - c->rest[0], beta - c->rest[1]);
    if (c->touching)
        return contact_end_or_stay(c, deflection);
    if (contact_lingers(c, deflection))
        contact_draw_after(c, alpha, beta, deflection);
    else if (deflection < c->config.release_counts)
        contact_follow_drift(c, alpha, beta);
    return contact_begin_or_wait(c, deflection);
}

void nav_contact_run(struct nav_contact *c, const double *samples, const uint8_t *good, size_t n, uint8_t *events,
                     double *peaks)
{
    for (size_t i = 0; i < n; i++) {
        enum nav_contact_event event = nav_contact_update(c, samples[2 * i], samples[2 * i + 1], good[i] != 0);
        events[i] = (uint8_t)event;
        peaks[i] = event == NAV_CONTACT_RELEASE ? c->peak : 0.0;
    }
}
