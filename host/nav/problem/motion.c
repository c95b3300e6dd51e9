#include "motion.h"

#include <math.h>

struct nav_noise nav_motion_noise(const struct nav_robot *robot, const struct nav_settings *settings,
                                  const struct nav_motion *motion)
{
    double distance = hypot(motion->step.x, motion->step.y), turn = fabs(motion->step.theta);
    double relative = robot->odometry_relative * robot->odometry_relative;
    double drift = settings->motion.drift_rad * settings->motion.drift_rad;
    struct nav_noise noise = {
        .position = relative * distance * fmax(distance, settings->motion.along_m),
        .heading = relative * turn * fmax(turn, settings->motion.turn_rad) + drift * distance,
    };
    if (robot->odometry_turn > 0.0) /* no error of the wheels is in it */
        noise.heading = robot->odometry_turn * robot->odometry_turn;
    noise.position += motion->unknown_m * motion->unknown_m;
    noise.heading += motion->unknown_rad * motion->unknown_rad;
    return noise;
}

void nav_pending_add(struct nav_pending *pending, struct nav_pose step, struct nav_noise noise)
{
    struct nav_pose to = nav_compose(pending->step, step);
    double x = to.x - pending->step.x, y = to.y - pending->step.y, turned = pending->noise.heading;
    pending->step = to;
    pending->noise.position +=
        noise.position + 0.5 * turned * (x * x + y * y) + y * pending->swing_y + x * pending->swing_x;
    pending->swing_x += turned * x;
    pending->swing_y += turned * y;
    pending->noise.heading += noise.heading;
}
