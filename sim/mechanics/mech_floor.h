/* Floors: what they are made of, and their height along the path of a whisker's tip.
 *
 * The textures are the mid-range values of the table of assumed classes (whisker physics, section 7). Every number is
 * an assumption taken before any classifier was trained on it, and none is tuned afterwards: a classifier has to cope
 * with these floors, the floors do not have to suit a classifier.
 *
 * Roughness is a stationary process on a lattice of 0.25 mm, so that it holds no wavelength below 0.5 mm (2000
 * cycles/m): exponential autocorrelation, spectrum falling as the square of the spatial frequency beyond 1/(2 pi
 * correlation). A weave is added whose every period is stretched by its own jitter.
 */
#ifndef MECH_FLOOR_H
#define MECH_FLOOR_H

#include <stdbool.h>

#include "sim_rng.h"

/* cffi: begin */
struct sim_floor_texture {
    const char *name;           /* as in a scene's list of textures */
    double rms_mm;              /* standard deviation of the roughness, weave not counted */
    double correlation_mm;      /* length at which its exponential autocorrelation falls to 1/e */
    double weave_wavelength_mm; /* 0: no weave */
    double weave_amplitude_mm;
    double friction_drop; /* static minus kinetic friction coefficient */
    bool pile;            /* its edges hook a tip that comes from a lower floor */
};
/* cffi: end */

#define SIM_TILE_LIFT_MM 0.2 /* tiles are laid within +- this of the same height */

static const struct sim_floor_texture SIM_FLOOR_TEXTURES[] = {
    {"VINYL", 0.055, 5.0, 0.0, 0.0, 0.05, false},
    {"SMOOTH", 0.3, 1.5, 3.0, 0.15, 0.10, false},
    {"ROUGH", 0.9, 3.0, 6.0, 0.4, 0.15, true},
};

enum { SIM_FLOOR_TEXTURE_COUNT = sizeof SIM_FLOOR_TEXTURES / sizeof SIM_FLOOR_TEXTURES[0] };

/* The floor of this name, or NULL if there is none. */
const struct sim_floor_texture *mech_floor_texture(const char *name);

struct mech_floor {
    struct sim_rng rng;
    double node[4];  /* roughness about the place, in standard deviations */
    double fraction; /* of a step, between node[1] and node[2] */
    double phase;    /* of the weave, rad */
    double stretch;  /* of this period of the weave */
};

void mech_floor_start(struct mech_floor *profile, const struct sim_floor_texture *floor, struct sim_rng rng);

/* Moves on by a distance, m. The past of the profile is not kept: a way back is new floor. */
void mech_floor_move(struct mech_floor *profile, const struct sim_floor_texture *floor, double distance);

/* Height of this floor at the place, m about its mean. */
double mech_floor_height(const struct mech_floor *profile, const struct sim_floor_texture *floor);

#endif
