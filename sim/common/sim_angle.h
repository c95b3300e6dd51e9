/* Angles, in radians. */
#ifndef SIM_ANGLE_H
#define SIM_ANGLE_H

#define SIM_PI 3.14159265358979323846
#define SIM_DEGREE (SIM_PI / 180)

double sim_wrap(double angle_rad); /* to (-pi, pi] */

#endif
