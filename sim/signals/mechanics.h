/* Whiskers one by one at level 1, with the mechanics of sim/mechanics: contacts and sweeps that a study prescribes tick
 * by tick, tilt of the plug and counts out; and a scene of 28 to measure speed with.
 */
#ifndef SIM_SIGNALS_MECHANICS_H
#define SIM_SIGNALS_MECHANICS_H

#include <stdbool.h>

#include "mech_drag.h"
#include "mech_shaft.h"

/* cffi: begin */
typedef struct sim_drag sim_drag;
typedef struct sim_mechanics_scene sim_mechanics_scene;

/* What a scene of 28 whiskers does: 4 against objects all the time, 8 dragged over floors, 16 touching nothing. */
struct sim_mechanics_setting {
    int level;    /* of mech_whisker.h */
    bool sliding; /* the contacts also slide along the shaft, at 10 mm/s */
    bool counts;  /* sensor noise and counts too */
    double tick_s;
};

/* Lets ticks pass for a whisker against objects. radius[i] 0: no touch; else as struct mech_touch. Writes the tilt in
 * the plane of bending (rad) and whether the contact holds. */
void sim_mechanics_touch(struct mech_shaft *shaft, size_t ticks, const double *radius, const double *theta,
                         const double *base_rate, double *tilt, unsigned char *touches);

/* A whisker standing on a floor; NULL if memory is short. */
sim_drag *sim_drag_new(const struct mech_whisker *whisker, const struct mech_stance *stance,
                       const struct sim_floor_texture *floor, uint64_t seed, int level, double tick_s);
void sim_drag_free(sim_drag *drag);

struct mech_stance sim_drag_stance(void); /* the default */

/* Lets ticks pass over floors: travel[i] m, number of the floor within `floors` and its height (m). Writes
 * tilt[tick][2] (rad; along the path, across it) and what the tip did: 0 sticks, 1 slips, 2 is hooked, 3 is at the
 * corner of a step; 4 is added if it has lifted off. */
void sim_drag_run(sim_drag *drag, const struct sim_floor_texture *floors, size_t ticks, const double *travel,
                  const unsigned char *floor, const double *height, double *tilt, unsigned char *event);

/* What the sensor of this whisker reads of tilt[tick][2]: counts[tick][2], with the sensor's noise of this seed. */
void sim_mechanics_counts(const struct mech_whisker *whisker, size_t ticks, double tick_s, const double *tilt,
                          uint64_t seed, uint16_t *counts);

/* A floor of mech_floor.h, or NULL beyond the last. */
const struct sim_floor_texture *sim_mechanics_floor(size_t floor);

/* A scene, or NULL if memory is short; whiskers differ by the seed. */
sim_mechanics_scene *sim_mechanics_scene_new(const struct sim_mechanics_setting *setting, uint64_t seed);
void sim_mechanics_scene_free(sim_mechanics_scene *scene);

/* Lets ticks pass. Returns a sum over all that came out, so that nothing is left out as unused. */
double sim_mechanics_scene_run(sim_mechanics_scene *scene, size_t ticks);
/* cffi: end */

#endif
