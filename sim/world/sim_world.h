/* The simulated world: a Create-sized robot with whiskers in an arena, one tick (500 us) at a time.
 *
 * What comes out is the angle of the magnetic field at each whisker's sensor, noise included: no counts, no bits, no
 * bytes. Equal scene, seed and commands give equal results; each purpose draws from its own stream of random
 * numbers, so one whisker's contacts do not change another's noise.
 */
#ifndef SIM_WORLD_H
#define SIM_WORLD_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "sim_contact.h"
#include "sim_field.h"
#include "sim_scene.h"

/* cffi: begin */
typedef struct sim_world sim_world;

/* A world at rest at the scene's start pose, or NULL if memory is short. */
sim_world *sim_world_new(const struct sim_scene *scene, uint64_t seed);
void sim_world_free(sim_world *world);

/* Commands the base from the next step on: m/s forward, rad/s anticlockwise. A faster command than the wheels allow
 * (0.5 m/s) is slowed down on the same curve. */
void sim_world_drive(sim_world *world, double v_m_s, double omega_rad_s);

/* Lets one tick (500 us) pass. */
void sim_world_step(sim_world *world);

/* Field angle of each lane at the last step, degrees about rest; fields holds one entry per whisker of the scene. */
void sim_world_fields(const sim_world *world, struct sim_field *fields);

struct sim_pose sim_world_pose(const sim_world *world); /* theta in (-pi, pi] */
bool sim_world_blocked(const sim_world *world);         /* the body pushed against a wall or a box at the last step */

/* Reported motion since the last call, in the frame of the last call: what a Create counts in whole millimetres and
 * whole degrees (the remainders are kept for the next call), with the errors of its wheels. */
void sim_world_odometry(sim_world *world, double *x_m, double *y_m, double *theta_rad);

size_t sim_world_lanes(const sim_world *world);
struct sim_contact sim_world_contact(const sim_world *world, size_t lane); /* of an object whisker */
double sim_world_spread(const sim_world *world, size_t lane);      /* of an object whisker's amplitudes, relative */
struct sim_tip sim_world_tip(const sim_world *world, size_t lane); /* of a texture whisker */
/* cffi: end */

/* What the wheels have counted since the start, with their errors: forward and anticlockwise. Reports change nothing.
 */
void sim_world_wheels(const sim_world *world, double *distance_m, double *angle_rad);

/* Distance between the body and the nearest wall or box, m, and where on the body that is: rad anticlockwise from
 * straight ahead, in (-pi, pi]. */
double sim_world_gap(const sim_world *world, double *bearing_rad);

#endif
