/* Whiskers one by one at level 1, with the mechanics of sim/mechanics: contacts and sweeps that a study prescribes tick
 * by tick, tilt of the plug and counts out.
 */
#ifndef SIM_SIGNALS_MECHANICS_H
#define SIM_SIGNALS_MECHANICS_H

#include <stdbool.h>

#include "mech_drag.h"
#include "mech_shaft.h"

/* cffi: begin */
typedef struct sim_drag sim_drag;

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
/* cffi: end */

#endif
