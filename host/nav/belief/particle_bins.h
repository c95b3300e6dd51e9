/* Bins of x, y and heading that a cloud occupies: how many particles it needs (KLD sampling, Fox 2003) and where most
 * of them are. */
#ifndef NAV_PARTICLE_BINS_H
#define NAV_PARTICLE_BINS_H

#include "particles.h"

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

/* Centre of the heaviest bin. */
struct nav_pose nav_bins_mode(const struct nav_bins *);

/* Particles that keep the divergence from the true belief below `error` in 99 of 100 cases when `bins` are occupied:
 * equation 13 of Fox, "Adapting the sample size in particle filters through KLD-sampling", with z = 2.326. */
double nav_bins_bound(double bins, double error);

/* How many of `least` .. `most` to draw from this belief when a share of them, `elsewhere`, falls anywhere: the number
 * n that its own occupied bins ask for, as systematic resampling would fill them. */
long nav_bins_needed(const struct nav_bins *, double error, double elsewhere, long least, long most);

size_t nav_bins_bytes(const struct nav_bins *);

#endif
