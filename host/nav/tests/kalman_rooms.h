/* What the tests of both Kalman filters share: rooms in which the exact answer is a line of arithmetic. */
#ifndef NAV_TESTS_KALMAN_ROOMS_H
#define NAV_TESTS_KALMAN_ROOMS_H

#include "kalman.h"
#include "near.h"
#include "rooms.h"

static const double NOTHING_READ[] = {0.0, 0.0}, RAY_READ[] = {0.0, 1.0}, TIP_READ[] = {1.0, 0.0};

/* Facing the right wall square on from (0.7, 0.6): the whisker's base is 0.25 m from it, 0.05 m more than its length.
 */
static inline struct nav_problem facing_wall(void)
{
    struct nav_problem p = room();
    p.prior.mean = (struct nav_pose){0.8, 0.6, 0.0};
    p.prior.sigma[0] = 0.03;
    p.prior.sigma[1] = 0.04;
    p.prior.sigma[2] = 1e-5; /* the heading is known: the range is linear in x */
    return p;
}

static inline void read_distance(struct nav_kalman *k, double distance)
{
    const double *reading[] = {NULL, &distance};
    nav_kalman_update(k, &(struct nav_evidence){reading, RAY_READ});
}

/* One window that says texture `is` with certainty. */
static inline void read_texture(struct nav_kalman *k, int is)
{
    const double loglik[] = {is == 0 ? 0.0 : -50.0, is == 1 ? 0.0 : -50.0};
    const double *reading[] = {loglik, NULL};
    nav_kalman_update(k, &(struct nav_evidence){reading, TIP_READ});
}

static inline void drive(struct nav_kalman *k, double metres)
{
    nav_kalman_predict(k, &(struct nav_motion){.step = {metres, 0.0, 0.0}});
}

/* Expected 0.15, read 0.14: the gain is 0.03^2 / (0.03^2 + 0.005^2), towards the wall. */
static inline void assert_contact_is_a_kalman_update(const struct nav_kalman *k)
{
    double prior = 0.0009, noise = 0.000025, gain = prior / (prior + noise);
    assert_near(k->belief.mean.x, 0.8 + gain * 0.01, 1e-6);
    assert_near(k->belief.mean.y, 0.6, 1e-6);
    assert_near(k->belief.covariance[0], prior * (1.0 - gain), 1e-8);
    assert_near(k->belief.covariance[4], 0.0016, 1e-7);
}

/* Before the border between the lower tiles at x = 0.5, heading for it, with an odometry that makes no errors. */
static inline struct nav_problem behind_the_border(void)
{
    struct nav_problem p = room();
    p.prior.mean = (struct nav_pose){0.3, 0.25, 0.0};
    p.prior.sigma[0] = p.prior.sigma[1] = 0.05;
    p.prior.sigma[2] = 1e-5;
    p.robot.odometry_relative = 0.0;
    p.settings.motion.drift_rad = 0.0;
    return p;
}

/* Drives eight steps; the tip reads tile 0 for four of them, then tile 1: it crossed between steps 4 and 5. */
static inline void cross(struct nav_kalman *k)
{
    for (int i = 1; i <= 8; i++) {
        drive(k, 0.02);
        read_texture(k, i > 4);
    }
}

#endif
