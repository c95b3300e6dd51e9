/* Bins of x, y and heading that a cloud occupies: how many particles it needs (KLD sampling, Fox 2003) and where most
 * of them are. */
#ifndef NAV_PARTICLE_BINS_H
#define NAV_PARTICLE_BINS_H

#include "particles.h"

/* How many particles to draw: `least` to `most`, by `error` as in nav_bins_bound. */
struct nav_sample {
    double error;
    long least, most;
};

struct nav_bins {
    double edge;         /* m */
    int turns;           /* bins per full turn */
    long slots;          /* power of two, at least twice the particles */
    struct nav_bin *bin; /* [slots] open addressing */
    long *filled;        /* slots in use, in order of first use */
    long count;
};

/* 0, or -1 without memory; nav_bins_free either way. edge in m, extent in rad. */
int nav_bins_init(struct nav_bins *, long particles, double edge, double extent);
void nav_bins_free(struct nav_bins *);

/* Sorts a cloud's weights into bins. */
void nav_bins_fill(struct nav_bins *, const struct nav_particles *);

/* Mean and the mass near it: at the mode next to `guess`, or at the heaviest bin when less than half of the mass is
 * near `guess`. Fills the bins if it needs them. */
struct nav_mode nav_particles_summary(const struct nav_particles *, struct nav_bins *, struct nav_pose guess);

/* Draws particles from the prior, as many as its bins ask for; see nav_particles_draw. False when none is free: the
 * particles are then where they were drawn. */
bool nav_particles_begin(struct nav_particles *, struct nav_bins *, const struct nav_likelihood *,
                         const struct nav_prior *, double anywhere, struct nav_rng *, const struct nav_sample *);

/* Centre of the heaviest bin. */
struct nav_pose nav_bins_mode(const struct nav_bins *);

/* Particles that keep the divergence from the true belief below `error` in 99 of 100 cases when `bins` are occupied:
 * equation 13 of Fox, "Adapting the sample size in particle filters through KLD-sampling", with z = 2.326. */
double nav_bins_bound(double bins, double error);

/* How many particles to draw from this belief when a share of them, `anywhere`, falls anywhere in the arena: the number
 * that its own occupied bins ask for, as systematic resampling would fill them. */
long nav_bins_needed(const struct nav_bins *, const struct nav_sample *, double anywhere);

size_t nav_bins_bytes(const struct nav_bins *);

#endif
