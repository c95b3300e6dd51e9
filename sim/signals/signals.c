#include "signals.h"

#include "sim_counts.h"

void sim_signals_run(sim_world *world, size_t ticks, uint16_t *counts)
{
    struct sim_field field[SIM_WHISKERS_MAX];
    size_t lanes = sim_world_lanes(world);
    for (size_t tick = 0; tick < ticks; tick++) {
        sim_world_step(world);
        sim_world_fields(world, field);
        for (size_t lane = 0; lane < lanes; lane++) {
            *counts++ = sim_counts(field[lane].alpha_deg);
            *counts++ = sim_counts(field[lane].beta_deg);
        }
    }
}
