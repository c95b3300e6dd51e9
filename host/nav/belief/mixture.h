/* A Gaussian mixture as a prior: what a filter listed once, in another process or another filter. Masses sum to 1. */
#ifndef NAV_MIXTURE_H
#define NAV_MIXTURE_H

#include "histogram.h"
#include "problem.h"
#include "rng.h"

/* Whether a prior is a mixture. */
bool nav_mixture_given(const struct nav_prior *);

/* Scales masses to sum 1. */
void nav_mixture_normalise(struct nav_component *, long count);

/* Mean and covariance of the components, those of one Gaussian. */
struct nav_gaussian nav_mixture_gaussian(const struct nav_prior *);

/* Any prior as a Gaussian. */
struct nav_gaussian nav_mixture_prior(const struct nav_problem *);

/* A pose drawn from the components. */
struct nav_pose nav_mixture_draw(const struct nav_prior *, struct nav_rng *);

/* Fills a histogram that has not moved yet with a prior that is not uniform: one Gaussian, or the components and
 * NAV_ANYWHERE evenly. Its total is not known before the next pass. */
void nav_mixture_fill(const struct nav_prior *, struct nav_histogram *);

/* Mass of a normal distribution between two values. */
double nav_normal_between(double low, double high, double mean, double sigma);

#endif
