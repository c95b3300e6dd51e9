/* The emulated robot's wheels on the ground of a simulated world, and its bumper at the world's walls and boxes. */
#ifndef CREATE_GROUND_H
#define CREATE_GROUND_H

#include "sim_create.h"
#include "sim_world.h"

/* Before the world's step: the world's base does what the robot's wheels are ordered to do. */
void create_ground_drive(const sim_create *create, sim_world *world);

/* After it: a tick of the robot, with what the wheels counted and what the bumper touches. */
void create_ground_tick(sim_create *create, const sim_world *world);

/* Sides of the bumper pressed by something at this distance from the body and at this place, as stimuli. */
uint32_t create_ground_bumps(double gap_m, double bearing_rad);

#endif
