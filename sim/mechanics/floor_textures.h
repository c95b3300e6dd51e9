/* Floor textures: the mid-range values of the table of assumed classes (whisker physics, section 7).
 *
 * Every number is an assumption taken before any classifier was trained on it, and none is tuned afterwards:
 * a classifier has to cope with these floors, the floors do not have to suit a classifier.
 */
#ifndef SIM_FLOOR_TEXTURES_H
#define SIM_FLOOR_TEXTURES_H

#include <stdbool.h>

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

#endif
