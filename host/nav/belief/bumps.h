/* A mixture of bumps as a prior: what a filter listed once, in another process or another filter. Masses sum to 1. */
#ifndef NAV_BUMPS_H
#define NAV_BUMPS_H

#include "histogram.h"
#include "problem.h"
#include "rng.h"

/* Whether a prior is a mixture. */
bool nav_bumps_given(const struct nav_prior *);

/* Scales masses to sum 1. */
void nav_bumps_normalise(struct nav_component *, long count);

/* Mean and covariance of the bumps, those of one Gaussian. */
struct nav_gaussian nav_bumps_gaussian(const struct nav_prior *);

/* A pose drawn from the bumps. */
struct nav_pose nav_bumps_draw(const struct nav_prior *, struct nav_rng *);

/* Fills a histogram that has not moved yet with a prior that is not uniform: one Gaussian, or the bumps and
 * NAV_ANYWHERE evenly. Its total is not known before the next pass. */
void nav_bumps_fill(const struct nav_prior *, struct nav_histogram *);

/* Mass of a normal distribution between two values. */
double nav_normal_between(double low, double high, double mean, double sigma);

/* The same for headings, which wrap: `half` a width on both sides of an angle that is `off` from the mean. */
double nav_heading_within(double off, double half, double sigma);

#endif
