/* Poses on the floor. */
#ifndef NAV_POSE_H
#define NAV_POSE_H

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

/* cffi: begin */
/* x, y in m (world: origin in the arena's lower left corner), theta in rad, anticlockwise from x. */
struct nav_pose {
    double x, y, theta;
};
/* cffi: end */

#define NAV_PI 3.14159265358979323846

/* An angle brought to -pi .. pi. */
double nav_wrap(double angle);

/* Pose reached from `from` by `step`, a motion in the frame of `from`; theta is not wrapped. */
struct nav_pose nav_compose(struct nav_pose from, struct nav_pose step);

#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif
