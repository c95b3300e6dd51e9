#include "mech_floor.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

#include "whisker_constants.h"

#define LATTICE_M 0.25e-3
#define LEAST_STRETCH 0.5
enum { MOST_NODES = 64 }; /* a leap further than this meets floor that has nothing to do with the last */

const struct sim_floor_texture *mech_floor_texture(const char *name)
{
    for (int i = 0; i < SIM_FLOOR_TEXTURE_COUNT; i++)
        if (strcmp(SIM_FLOOR_TEXTURES[i].name, name) == 0)
            return &SIM_FLOOR_TEXTURES[i];
    return NULL;
}

static double mech_floor_stretched(struct sim_rng *rng)
{
    return fmax(LEAST_STRETCH, 1 + SIM_TIP_JITTER * sim_rng_normal(rng));
}

static double mech_floor_next_node(struct mech_floor *profile, const struct sim_floor_texture *floor)
{
    double keep = exp(-1e3 * LATTICE_M / floor->correlation_mm);
    return keep * profile->node[3] + sqrt(1 - keep * keep) * sim_rng_normal(&profile->rng);
}

static void mech_floor_shift(struct mech_floor *profile, const struct sim_floor_texture *floor)
{
    double next = mech_floor_next_node(profile, floor);
    for (int i = 0; i < 3; i++)
        profile->node[i] = profile->node[i + 1];
    profile->node[3] = next;
}

void mech_floor_start(struct mech_floor *profile, const struct sim_floor_texture *floor, struct sim_rng rng)
{
    *profile = (struct mech_floor){.rng = rng};
    profile->node[3] = sim_rng_normal(&profile->rng);
    for (int i = 0; i < 3; i++)
        mech_floor_shift(profile, floor);
    profile->phase = 2 * SIM_PI * sim_rng_uniform(&profile->rng);
    profile->stretch = mech_floor_stretched(&profile->rng);
}

void mech_floor_move(struct mech_floor *profile, const struct sim_floor_texture *floor, double distance)
{
    profile->fraction += fabs(distance) / LATTICE_M;
    for (int i = 0; profile->fraction >= 1 && i < MOST_NODES; i++) {
        profile->fraction -= 1;
        mech_floor_shift(profile, floor);
    }
    profile->fraction = fmod(profile->fraction, 1);
    if (floor->weave_wavelength_mm <= 0)
        return;
    profile->phase += 2 * SIM_PI * fabs(distance) * 1e3 / (floor->weave_wavelength_mm * profile->stretch);
    if (profile->phase >= 2 * SIM_PI) {
        profile->phase = fmod(profile->phase, 2 * SIM_PI);
        profile->stretch = mech_floor_stretched(&profile->rng);
    }
}

/* Catmull and Rom's cubic through the nodes. */
double mech_floor_height(const struct mech_floor *profile, const struct sim_floor_texture *floor)
{
    const double *n = profile->node;
    double t = profile->fraction;
    double rough =
        n[1] +
        t / 2 * (n[2] - n[0] + t * (2 * n[0] - 5 * n[1] + 4 * n[2] - n[3] + t * (3 * (n[1] - n[2]) + n[3] - n[0])));
    double weave = floor->weave_amplitude_mm > 0 ? floor->weave_amplitude_mm * sin(profile->phase) : 0;
    return 1e-3 * (floor->rms_mm * rough + weave);
}
