#include "radial_whisk.h"

#include <math.h>
#include <stdbool.h>

#include "pose.h"

#define NODES 25        /* of the trapezoid rule, over ... */
#define NODES_REACH 4.0 /* ... so many standard deviations to either side */

#define CALIBRATED 3.0 /* standard deviations: pushes that are longer or shorter were not calibrated */

/* The alternative "none of those calibrated". */
#define STRANGE 0.003      /* its share among whisks */
#define STRANGE_PEAK 0.25  /* its density of ln peak: anywhere within a factor of 50 */
#define STRANGE_TURN 1e-4  /* a calibrated whisk bends in a strange direction this rarely */
#define STRANGE_LOOK 0.3   /* its likelihood of any misfit, where a calibrated one's typical is 1 */
#define STRANGE_FROZEN 0.1 /* of the push with equal samples, beyond calibration's: a calibrated one has it ... */
#define FROZEN_RARELY 1e-6 /* ... this rarely */
#define SPOILED 0.5        /* as STRANGE_FROZEN, share of samples lost */

double nav_whisk_height(double kappa, double cone_mm, double radius_mm)
{
    double rest = 1.0 - radius_mm / cone_mm;
    return rest > 0.0 ? log(rest / (rest + kappa * radius_mm / cone_mm)) : (double)-INFINITY;
}

void nav_whisk_terms(const struct nav_shape *shape, double *terms)
{
    for (int k = 0; k < NAV_WHISK_TERMS; k++)
        terms[k] = (double)NAN;
    if (shape->quality != NAV_SHAPE_WHOLE || !(shape->turn > 0.0) || !(shape->reported > 0.0))
        return;
    double seconds = shape->stop_s - shape->onset_s;
    terms[NAV_WHISK_TURN] = log(shape->turn);
    terms[NAV_WHISK_RATE] = log(shape->turn / seconds);
    /* Where nothing is reported the reported angle is counted in seconds. */
    bool reported = fabs(shape->reported - seconds) > 1e-6 * seconds;
    terms[NAV_WHISK_REPORTED] = reported ? log(shape->reported / shape->turn) : 0.0;
    terms[NAV_WHISK_BOW] = shape->bow;
    terms[NAV_WHISK_BACK] = shape->back;
}

/* What of a push's length lies outside those calibrated: whatever weight these gave it, there the whisker bends as far
 * as it is pushed. Takes it from *off. */
static double radial_whisk_take_far_turn(const struct nav_whisk_model *m, double *off)
{
    double most = CALIBRATED * m->scatter[NAV_WHISK_TURN];
    double near = fmax(-most, fmin(most, *off)), far = *off - near;
    *off = near;
    return far;
}

/* ln h that the whisk shows, and its variance but for the spread. */
static double radial_whisk_seen_height(const struct nav_whisk_model *m, const struct nav_shape *shape, double *variance)
{
    double terms[NAV_WHISK_TERMS], off[NAV_WHISK_TERMS];
    double height = log(shape->peak) - m->log_gain;
    nav_whisk_terms(shape, terms);
    *variance = shape->noise * shape->noise;
    for (int k = 0; k < NAV_WHISK_TERMS; k++) {
        bool missing = !isfinite(terms[k]);
        off[k] = missing ? 0.0 : terms[k] - m->mean[k];
        if (k == NAV_WHISK_TURN)
            height -= radial_whisk_take_far_turn(m, &off[k]);
        height -= m->weight[k] * off[k];
        *variance += missing ? m->weight[k] * m->weight[k] * m->scatter[k] * m->scatter[k] : 0.0;
    }
    for (int k = 0; k < NAV_WHISK_TERMS; k++)
        for (int j = 0; j < NAV_WHISK_TERMS; j++)
            *variance += off[k] * m->covariance[k][j] * off[j];
    return height;
}

/* How much likelier the whisk's looks are if it is none of those calibrated: direction, smoothness, lost samples. */
static double radial_whisk_strangeness(const struct nav_whisk_model *m, const struct nav_shape *shape)
{
    double along = 0.0, length = 0.0, odds = 1.0;
    for (int a = 0; a < m->axes; a++) {
        along += m->direction[a] * shape->direction[a];
        length += m->direction[a] * m->direction[a];
    }
    if (length > 0.0) {
        double off = acos(fmax(-1.0, fmin(1.0, along))) / m->direction_sd;
        double usual = exp(-0.5 * off * off) / (m->direction_sd * sqrt(2.0 * NAV_PI)) + STRANGE_TURN / NAV_PI;
        odds *= 1.0 / NAV_PI / usual;
    }
    if (shape->quality == NAV_SHAPE_WHOLE) {
        double off = fmax(0.0, (log(shape->misfit + 1e-9) - m->log_misfit) / m->log_misfit_sd);
        odds *= STRANGE_LOOK / (exp(-0.5 * off * off) + STRANGE_TURN);
    }
    if (shape->frozen > m->frozen + STRANGE_FROZEN || shape->bad > SPOILED)
        odds /= FROZEN_RARELY;
    return odds;
}

/* Radius at which ln h is this, held within the possible ones; how much ln h falls per mm there. */
static double radial_whisk_radius_of(const struct nav_whisk_model *m, double height, double *fall)
{
    double h = exp(fmin(height, 0.0));
    double radius = m->cone_mm * (1.0 - h) / (1.0 - h + m->kappa * h);
    radius = fmax(m->low_mm, fmin(m->high_mm, radius));
    double x = radius / m->cone_mm;
    *fall = m->kappa / (m->cone_mm * (1.0 - x) * (1.0 - x + m->kappa * x));
    return radius;
}

struct moments {
    double mass, mean, square, tip; /* mass: likelihood, mean over all possible radii */
};

/* Moments of the radius by the trapezoid rule over the part of the possible radii that counts. */
static struct moments radial_whisk_weigh(const struct nav_whisk_model *m, double height, double variance)
{
    double fall, nearest = radial_whisk_radius_of(m, height, &fall), reach = NODES_REACH * sqrt(variance) / fall;
    double low = fmax(m->low_mm, nearest - reach), high = fmin(m->high_mm, nearest + reach);
    double step = (high - low) / (NODES - 1), scale = 0.5 / variance;
    double least = height - nav_whisk_height(m->kappa, m->cone_mm, nearest);
    struct moments sum = {0};
    for (int i = 0; i < NODES; i++) {
        double radius = low + i * step, off = height - nav_whisk_height(m->kappa, m->cone_mm, radius);
        double weight = exp(scale * (least * least - off * off)) * (i == 0 || i == NODES - 1 ? 0.5 : 1.0);
        sum.mass += weight;
        sum.mean += weight * (radius - nearest);
        sum.square += weight * (radius - nearest) * (radius - nearest);
        sum.tip += weight * fmax(0.0, fmin(1.0, 0.5 + (radius - m->tip_mm) / step));
    }
    sum.mean = nearest + sum.mean / sum.mass;
    sum.square = sum.square / sum.mass + nearest * (2.0 * sum.mean - nearest);
    sum.tip /= sum.mass;
    sum.mass *= step / (m->high_mm - m->low_mm) * exp(-scale * least * least) / sqrt(2.0 * NAV_PI * variance);
    return sum;
}

void nav_whisk_estimate(const struct nav_whisk_model *m, const struct nav_shape *shape, struct nav_whisk_estimate *out)
{
    double middle = 0.5 * (m->low_mm + m->high_mm), span = m->high_mm - m->low_mm;
    struct nav_whisk_estimate prior = {middle, span / sqrt(12.0), (m->high_mm - m->tip_mm) / span, 0.0};
    *out = prior;
    if (shape->quality == NAV_SHAPE_NONE || !(shape->peak > 0.0))
        return;
    double variance, height = radial_whisk_seen_height(m, shape, &variance);
    variance += m->spread * m->spread;
    if (!isfinite(height) || !isfinite(variance))
        return;
    struct moments usual = radial_whisk_weigh(m, height, variance);
    double strange = STRANGE * STRANGE_PEAK * radial_whisk_strangeness(m, shape);
    double belief = (1.0 - STRANGE) * usual.mass;
    belief = belief > 0.0 ? belief / (belief + strange) : 0.0;
    double mean = belief * usual.mean + (1.0 - belief) * prior.radius_mm;
    double square =
        belief * usual.square + (1.0 - belief) * (prior.radius_mm * prior.radius_mm + prior.sigma_mm * prior.sigma_mm);
    *out = (struct nav_whisk_estimate){mean, sqrt(fmax(0.0, square - mean * mean)),
                                       belief * usual.tip + (1.0 - belief) * prior.tip, belief};
}
