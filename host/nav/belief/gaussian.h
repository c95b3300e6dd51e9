/* Gaussian beliefs over (x, y, theta): motion, mass near the mean. Covariances are row-major 3x3, m and rad. */
#ifndef NAV_GAUSSIAN_H
#define NAV_GAUSSIAN_H

#include <stdbool.h>

#include "motion.h"
#include "pose.h"

struct nav_gaussian {
    struct nav_pose mean;
    double covariance[9];
};

/* A mode of a belief, and how far a pose is from it: squared distance and angle by NAV_NEAR_M and NAV_NEAR_RAD. What is
 * farther than NAV_MODE_REACH does not belong to it. */
enum { NAV_MODES_MOST = 32 };
#define NAV_MODE_REACH 4.0
struct nav_mode {
    struct nav_pose mean;
    double mass;
};
double nav_mode_distance(struct nav_pose mean, struct nav_pose);

struct nav_estimate;
struct nav_component;

/* A uniform belief as a Gaussian: the arena's centre with the arena's own spread. */
struct nav_gaussian nav_gaussian_uniform(const struct nav_arena *);

/* The belief that a robot was carried: NAV_CARRIED of it uniform, by its moments. */
void nav_gaussian_carry(struct nav_gaussian *, const struct nav_arena *);

/* Pose, covariance and confidence of a Gaussian belief. */
void nav_gaussian_estimate(const struct nav_gaussian *, struct nav_estimate *);

/* A mixture of Gaussians, summed one by one. Headings are taken relative to `about`, which the caller sets, near the
 * mixture's mean. */
struct nav_gaussian_sum {
    struct nav_pose about;
    double mass, first[3], second[9];
};
void nav_gaussian_sum_add(struct nav_gaussian_sum *, double mass, const struct nav_gaussian *);

/* Mean and covariance of the mixture; its mass must be above 0. */
struct nav_gaussian nav_gaussian_sum_moments(const struct nav_gaussian_sum *);

/* Mass of a component (nav_filter_components) within NAV_NEAR_M and NAV_NEAR_RAD of a pose: its distance from there,
 * squared, and the angle. Beyond NAV_COMPONENT_REACH standard deviations it holds nothing. */
#define NAV_COMPONENT_REACH 4.0
double nav_component_near(double square, double turn, double sigma_m, double sigma_rad);

/* Covariance about another pose than the mean. */
void nav_gaussian_covariance(const struct nav_gaussian *, struct nav_pose about, double out[9]);

/* The belief as a lattice of components, as nav_filter_components says. */
long nav_gaussian_components(const struct nav_gaussian *, struct nav_component *out, long room);

/* Moves a belief by `step` with noise: the paper's Gaussian approximation of the banana, to first order in the heading.
 */
void nav_gaussian_move(struct nav_gaussian *, struct nav_pose step, const struct nav_noise *);

/* Inverse of a covariance; false when it is not positive definite (out is then untouched). */
bool nav_gaussian_invert(const double covariance[9], double out[9]);

/* Belief mass within `radius` m and `angle` rad of the mean, headings a turn apart being the same. */
double nav_gaussian_mass(const struct nav_gaussian *, double radius, double angle);

#endif
