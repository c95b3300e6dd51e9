/* A differential-drive base the size of an iRobot Create, and what it reports of its motion. */
#ifndef SIM_BASE_H
#define SIM_BASE_H

#include <stdint.h>

#include "sim_angle.h"
#include "sim_rng.h"
#include "sim_scene.h"

#define SIM_BASE_WHEEL_LIMIT 0.5 /* m/s: the Create's limit for each wheel */
#define SIM_BASE_TRACK 0.258     /* m between the wheels */

/* Commands take effect at once: the base's own acceleration is not modelled at this level. */
struct sim_base {
    double v, omega; /* m/s, rad/s, within the wheels' limit */
};

/* What the wheels count differs from the motion: a scale error of the whole run, N(0, 0.01), and a gain of every move
 * (a stretch of constant command), N(1, 0.02) clipped to +-0.05; distance and angle apart. */
struct sim_odometer {
    struct sim_rng rng;
    double scale_distance, scale_angle; /* this run */
    double gain_distance, gain_angle;   /* this move */
    double distance_mm, angle_deg;      /* counted, not yet reported */
    double total_mm, total_deg;         /* counted since the start */
};

/* Sets the command; both wheels are slowed by the same factor if one exceeds its limit. Returns 1 if it is a new one.
 */
int sim_base_drive(struct sim_base *base, double v, double omega);

/* Where the base would be after dt seconds: an arc, taken as its chord. theta in (-pi, pi]. */
struct sim_pose sim_base_advance(const struct sim_base *base, struct sim_pose from, double dt);

void sim_odometer_start(struct sim_odometer *odometer, struct sim_rng rng);
void sim_odometer_new_move(struct sim_odometer *odometer);
void sim_odometer_count(struct sim_odometer *odometer, double distance_m, double angle_rad);

/* Reports whole millimetres and whole degrees and keeps the remainder; the motion is that of the arc they make. */
struct sim_pose sim_odometer_report(struct sim_odometer *odometer);

#endif
