/* A Gaussian over pose and errors of the odometry since a pose that is known: how a particle goes on. */
#ifndef NAV_GRID_MOTION_H
#define NAV_GRID_MOTION_H

#include "motion.h"
#include "rng.h"

enum {
    NAV_GRID_X,
    NAV_GRID_Y,
    NAV_GRID_HEADING,
    NAV_GRID_DISTANCE_GAIN, /* relative error of the odometry's distances ... */
    NAV_GRID_TURN_GAIN,     /* ... and turns: each keeps its value over some distance (Ornstein-Uhlenbeck) */
    NAV_GRID_STATES,
    NAV_GRID_POSE = 3
};

struct nav_grid_gaussian {
    double mean[NAV_GRID_STATES], cov[NAV_GRID_STATES][NAV_GRID_STATES];
};

/* How the odometry errs. */
struct nav_grid_odometry {
    double relative; /* standard deviation of the gains */
    double memory_m; /* over which they keep their value, and through any turn on the spot */
    double drift;    /* rad^2 of heading a straight metre */
    double turn;     /* rad, of the turn of any row: a gyroscope's, in place of gain and drift; 0: there is none */
};

/* Pose (0, 0, 0), known; of the gains nothing but their spread is. */
void nav_grid_gaussian_begin(struct nav_grid_gaussian *, const struct nav_grid_odometry *);

/* A row's motion as the wheels report it. lost: variance of motion that was not reported. */
void nav_grid_gaussian_move(struct nav_grid_gaussian *, const struct nav_grid_odometry *, struct nav_pose step,
                            struct nav_noise lost);

/* A measurement of slope . (x, y, heading): `innovation` is how far it is above the mean's. Returns its variance
 * before, noise included. */
double nav_grid_gaussian_variance(const struct nav_grid_gaussian *, const double slope[NAV_GRID_POSE], double noise);
void nav_grid_gaussian_measure(struct nav_grid_gaussian *, const double slope[NAV_GRID_POSE], double innovation,
                               double noise);

/* Lower triangular root of the pose's covariance. */
struct nav_grid_root {
    double at[NAV_GRID_POSE][NAV_GRID_POSE];
};
struct nav_grid_root nav_grid_gaussian_root(const struct nav_grid_gaussian *);

struct nav_pose nav_grid_gaussian_draw(const struct nav_grid_gaussian *, const struct nav_grid_root *,
                                       struct nav_rng *);

/* Log-density of a pose, but for a constant. */
double nav_grid_gaussian_density(const struct nav_grid_gaussian *, const struct nav_grid_root *, struct nav_pose);

/* The pose is known now: corrects the gains by it. */
void nav_grid_gaussian_set(struct nav_grid_gaussian *, struct nav_pose);

#endif
