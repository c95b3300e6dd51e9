/* The height of a floor along the path of a whisker's tip.
 *
 * Roughness is a stationary process on a lattice of 0.25 mm, so that it holds no wavelength below 0.5 mm (2000
 * cycles/m): exponential autocorrelation, spectrum falling as the square of the spatial frequency beyond 1/(2 pi
 * correlation). A weave is added whose every period is stretched by its own jitter.
 */
#ifndef MECH_PROFILE_H
#define MECH_PROFILE_H

#include "floor_textures.h"
#include "sim_rng.h"

struct mech_profile {
    struct sim_rng rng;
    double node[4];  /* roughness about the place, in standard deviations */
    double fraction; /* of a step, between node[1] and node[2] */
    double phase;    /* of the weave, rad */
    double stretch;  /* of this period of the weave */
};

void mech_profile_start(struct mech_profile *profile, const struct sim_floor_texture *floor, struct sim_rng rng);

/* Moves on by a distance, m. The past of the profile is not kept: a way back is new floor. */
void mech_profile_move(struct mech_profile *profile, const struct sim_floor_texture *floor, double distance);

/* Height of this floor at the place, m about its mean. */
double mech_profile_height(const struct mech_profile *profile, const struct sim_floor_texture *floor);

#endif
