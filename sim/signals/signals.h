/* Level 1: the counts that whiskers deliver, straight from the world, with nothing between that could go wrong. */
#ifndef SIM_SIGNALS_H
#define SIM_SIGNALS_H

#include "sim_world.h"

/* cffi: begin */
/* Lets ticks pass and writes what each whisker's sensor would read: counts[tick][lane][axis], axis 0 alpha, 1 beta,
 * room for ticks * sim_world_lanes() * 2 of them. The same transfer from field to counts as the bit-level sensor model.
 */
void sim_signals_run(sim_world *world, size_t ticks, uint16_t *counts);
/* cffi: end */

#endif
