#include "create_ground.h"

#include <math.h>

#include "whisker_constants.h"

/* The bumper reaches round the front half; in its middle both sides are pressed. How far it gives way before the body
 * itself is stopped is not in the manuals: a small step of it. */
#define BUMPER_HALF_RAD (90 * SIM_DEGREE)
#define BOTH_SIDES_RAD (10 * SIM_DEGREE)
#define BUMPER_TRAVEL_M 1e-3

uint32_t create_ground_bumps(double gap_m, double bearing_rad)
{
    uint32_t sides = 0;
    if (gap_m > BUMPER_TRAVEL_M || fabs(bearing_rad) > BUMPER_HALF_RAD)
        return 0;
    if (bearing_rad > -BOTH_SIDES_RAD)
        sides |= SIM_CREATE_BUMP_LEFT;
    if (bearing_rad < BOTH_SIDES_RAD)
        sides |= SIM_CREATE_BUMP_RIGHT;
    return sides;
}

void create_ground_drive(const sim_create *create, sim_world *world)
{
    double v_m_s, omega_rad_s;
    sim_create_speed(create, &v_m_s, &omega_rad_s);
    sim_world_drive(world, v_m_s, omega_rad_s);
}

void create_ground_tick(sim_create *create, const sim_world *world)
{
    struct sim_create_motion motion;
    double bearing_rad;
    double gap_m = sim_world_gap(world, &bearing_rad);
    sim_world_wheels(world, &motion.distance_m, &motion.angle_rad);
    motion.stimuli = create_ground_bumps(gap_m, bearing_rad);
    sim_create_tick(create, &motion);
}
