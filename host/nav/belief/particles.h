/* Weighted particles: motion, likelihood, resampling, moments, modes. */
#ifndef NAV_PARTICLES_H
#define NAV_PARTICLES_H

#include "gaussian.h"
#include "likelihood.h"
#include "motion.h"
#include "rng.h"

/* One column per quantity. Headings are kept as unit vectors, so that no particle needs a sine. Weights sum to 1. */
struct nav_particles {
    long count, room;
    float *x, *y; /* [room] m */
    float *c, *s; /* [room] cosine and sine of the heading */
    float *weight;
    /* Of particles that estimate the odometry's errors, NULL for others: true distance and turn by the reported ones,
     * less 1; standard deviation of the odometry noise by the model's. */
    float *gain, *turn_gain, *noise;
    float *mode;   /* index among the modes last gathered, -1: none; NULL as above */
    float *loglik; /* of the row last weighed */
    float spread;  /* standard deviation of the prior of the gains */
    int columns;   /* kept when particles are resampled */
    float *memory, *spare;
};

/* odometry: with columns for its errors, gains of standard deviation `spread`, and for modes. 0, or -1 without memory;
 * nav_particles_free either way. */
int nav_particles_init(struct nav_particles *, long room, bool odometry, double spread);
void nav_particles_free(struct nav_particles *);
size_t nav_particles_bytes(const struct nav_particles *);

/* A pose drawn from the prior, from its free part if that can be found in a few dozen draws: false otherwise.
 * anywhere: share of a mixture's draws that are uniform. */
bool nav_particles_draw(const struct nav_likelihood *, const struct nav_prior *, double anywhere, struct nav_rng *,
                        struct nav_pose *);

/* Puts a particle; its weight stays. */
void nav_particles_set(struct nav_particles *, long i, struct nav_pose);

/* Adds a particle when there is room, the odometry's errors drawn from their prior. */
void nav_particles_add(struct nav_particles *, struct nav_pose, double weight, struct nav_rng *);

struct nav_pose nav_particles_pose(const struct nav_particles *, long i);

/* Moves every particle by `step` in its own frame, with noise of its own: the cloud becomes the banana. known: all of
 * the motion was reported; else no particle takes less than the model's noise. */
void nav_particles_move(struct nav_particles *, struct nav_pose step, const struct nav_noise *, bool known,
                        struct nav_rng *);

/* Multiplies the weights by the likelihood of the row last read and normalises. A particle that stands where the map
 * is not free gets no weight while another is free. Returns the log of the mean likelihood. mass: of the belief that
 * the particles hold, with which they report to the measurement models what they expect (trust.h); below 0: they report
 * nothing. */
double nav_particles_weigh(struct nav_particles *, struct nav_likelihood *, double mass);

void nav_particles_scale(struct nav_particles *, double factor);

/* Effective sample size: how many equal particles these are worth. */
double nav_particles_effective(const struct nav_particles *);

/* Systematic resampling to `count` particles: particle i is taken count * weight times on average, never off by one or
 * more. offset: 0 <= offset < 1, random. Weights are equal afterwards. */
void nav_particles_resample(struct nav_particles *, long count, double offset);

/* Mass within NAV_NEAR_M and NAV_NEAR_RAD of a pose, and the mean pose of that part. */
double nav_particles_near(const struct nav_particles *, struct nav_pose, struct nav_pose *mean);

/* Covariance of all particles about a pose, once they are moved by what is pending; row-major, m and rad. */
void nav_particles_covariance(const struct nav_particles *, const struct nav_pending *, struct nav_pose about,
                              double covariance[9]);

/* Gathers particles into modes: their number, at most NAV_MODES_MOST; what is left then belongs to none. */
int nav_particles_modes(struct nav_particles *, struct nav_mode mode[NAV_MODES_MOST]);

/* What each mode last gathered weighs now: mass[modes]. */
void nav_particles_masses(const struct nav_particles *, double *mass, int modes);

/* Multiplies the weights of each mode last gathered by its factor; normalises. Where no weight would be left they stay
 * as they are. */
void nav_particles_weigh_modes(struct nav_particles *, const double *factor, int modes);

/* The particles moved by what is pending, as nav_filter_components lists them, masses times `mass`. about: pose near
 * which their density gives the width of each. */
long nav_particles_components(const struct nav_particles *, struct nav_pose about, const struct nav_pending *,
                              double mass, struct nav_component *out, long room);

/* Mass of those components within NAV_NEAR_M and NAV_NEAR_RAD of a pose. */
double nav_particles_within(const struct nav_particles *, struct nav_pose about, const struct nav_pending *,
                            struct nav_pose);

#endif
