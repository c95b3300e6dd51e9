#include "calibration.h"

#include <math.h>
#include <string.h>

static const double LEAST = 0.7, MOST = 1.3;
static const double START_SIGMA = 0.1, WALK_VARIANCE = 1e-6; /* per stretch */
static const double SURE = 0.9;
static const double TOLD_AGAIN = 2.0; /* a filter's spreads at both ends hide errors that they share: variance factor */
static const double JUMP = 0.5;       /* a ratio this far off is a kidnap or a wrong mode, not the wheels */

void nav_calibration_init(struct nav_calibration *c)
{
    const struct nav_ratio start = {1.0, START_SIGMA * START_SIGMA};
    *c = (struct nav_calibration){.distance = start, .turn = start};
}

struct nav_motion nav_calibration_apply(const struct nav_calibration *c, const struct nav_motion *motion)
{
    struct nav_motion out = *motion;
    out.step.x *= c->distance.value;
    out.step.y *= c->distance.value;
    out.step.theta *= c->turn.value;
    return out;
}

/* Takes a measured factor by which the present value is still off. */
static void calibration_follow(struct nav_ratio *r, double factor, double variance)
{
    if (!(fabs(factor - 1.0) < JUMP) || !isfinite(variance))
        return;
    r->variance += WALK_VARIANCE;
    double gain = r->variance / (r->variance + variance);
    r->value = fmin(fmax(r->value * (1.0 + gain * (factor - 1.0)), LEAST), MOST);
    r->variance *= 1.0 - gain;
}

static void calibration_begin(struct nav_calibration *c, const struct nav_estimate *now)
{
    c->sure = now->confidence >= SURE;
    c->from = now->pose;
    memcpy(c->from_covariance, now->covariance, sizeof c->from_covariance);
    c->reported = (struct nav_pose){0.0, 0.0, 0.0};
}

/* Length of the stretch by the filter over that by the wheels, along the wheels' direction. */
static void calibration_compare_distance(struct nav_calibration *c, const struct nav_estimate *now)
{
    double reported = hypot(c->reported.x, c->reported.y), cos0 = cos(c->from.theta), sin0 = sin(c->from.theta);
    double dx = now->pose.x - c->from.x, dy = now->pose.y - c->from.y;
    double along = ((cos0 * dx + sin0 * dy) * c->reported.x + (cos0 * dy - sin0 * dx) * c->reported.y) / reported;
    const double *a = c->from_covariance, *b = now->covariance;
    double variance = (a[0] + a[4] + b[0] + b[4]) / 2.0;
    calibration_follow(&c->distance, along / reported, TOLD_AGAIN * variance / (reported * reported));
}

static void calibration_compare_turn(struct nav_calibration *c, const struct nav_estimate *now)
{
    double reported = c->reported.theta, off = nav_wrap(now->pose.theta - c->from.theta - reported);
    calibration_follow(&c->turn, 1.0 + off / reported,
                       TOLD_AGAIN * (c->from_covariance[8] + now->covariance[8]) / (reported * reported));
}

void nav_calibration_learn(struct nav_calibration *c, const struct nav_motion *applied, const struct nav_estimate *now)
{
    bool known = applied->unknown_m <= 0.0 && applied->unknown_rad <= 0.0;
    c->reported = nav_compose(c->reported, applied->step);
    if (!c->sure || !known || now->confidence < SURE) {
        calibration_begin(c, now);
        return;
    }
    bool far = hypot(c->reported.x, c->reported.y) >= NAV_STRETCH_M, round = fabs(c->reported.theta) >= NAV_STRETCH_RAD;
    if (far && !round)
        calibration_compare_distance(c, now);
    if (round)
        calibration_compare_turn(c, now);
    if (far || round)
        calibration_begin(c, now);
}
