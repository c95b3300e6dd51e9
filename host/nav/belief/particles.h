/* A cloud of weighted poses: motion, resampling, moments. */
#ifndef NAV_PARTICLES_H
#define NAV_PARTICLES_H

#include "likelihood.h"
#include "motion.h"
#include "rng.h"

/* Headings are kept as unit vectors, so that no particle needs a sine. Weights sum to 1. */
struct nav_particles {
    long count, room;
    float *x, *y; /* [room] m */
    float *c, *s; /* [room] cosine and sine of the heading */
    float *weight;
    float *memory;
};

/* 0, or -1 without memory; nav_particles_free either way. */
int nav_particles_init(struct nav_particles *, long room);
void nav_particles_free(struct nav_particles *);

/* A pose drawn from the prior, from its free part if that can be found in a few dozen draws. */
struct nav_pose nav_particles_draw(const struct nav_likelihood *, const struct nav_prior *, struct nav_rng *);

/* Puts a particle; its weight stays. */
void nav_particles_set(struct nav_particles *, long i, struct nav_pose);

/* Moves every particle by `step` in its own frame, with noise of its own: the cloud becomes the banana. */
void nav_particles_move(struct nav_particles *, struct nav_pose step, const struct nav_noise *, struct nav_rng *);

/* Multiplies the weights by the likelihood of the row last read and normalises. Returns their mean before that,
 * relative to the likelihood that the row could have had at best; 0 when no particle stands free: weights are then
 * kept. scratch: [count]. */
double nav_particles_weigh(struct nav_particles *, const struct nav_likelihood *, float *scratch);

/* 1 / sum of squared weights: how many equal particles these are worth. */
double nav_particles_effective(const struct nav_particles *);

/* Systematic resampling: fills to[0 .. count - 1] from `from`, particle i being taken count * weight times on average,
 * never off by one or more. offset: 0 <= offset < 1, random. Weights of the result are equal. */
void nav_particles_resample(const struct nav_particles *from, struct nav_particles *to, long count, double offset);

/* Mean pose of the whole cloud. */
struct nav_pose nav_particles_mean(const struct nav_particles *);

/* Mass within NAV_NEAR_M and NAV_NEAR_RAD of a pose, and the mean pose of that part. */
double nav_particles_near(const struct nav_particles *, struct nav_pose, struct nav_pose *mean);

/* Covariance of the whole cloud about a pose, row-major, m and rad. */
void nav_particles_covariance(const struct nav_particles *, struct nav_pose about, double covariance[9]);

#endif
