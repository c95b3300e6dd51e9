/* A Gaussian over the pose, the odometry's gains, the axes of the world, a lattice of tiles and any number of faces,
 * all correlated: a measurement of one corrects the rest. */
#ifndef NAV_JOINT_H
#define NAV_JOINT_H

#include "motion.h"
#include "pose.h"

enum {
    NAV_JOINT_X,
    NAV_JOINT_Y,
    NAV_JOINT_HEADING,
    NAV_JOINT_DISTANCE_GAIN, /* relative error of the odometry's distances */
    NAV_JOINT_TURN_GAIN,     /* and of its turns */
    NAV_JOINT_AXES,          /* direction of the world's right angles, rad */
    NAV_JOINT_LATTICE_U,     /* m, of a line of the lattice across its first axis */
    NAV_JOINT_LATTICE_V,     /* and across its second */
    NAV_JOINT_PITCH,         /* m */
    NAV_JOINT_LATTICE_TURN,  /* rad */
    NAV_JOINT_FACES          /* the first face; two numbers each: direction of its normal, offset along it */
};

#define NAV_JOINT_AXES_KNOWN 1.0 /* rad^2: variance below which the axes are known */

/* mean and cov belong to the owner; cov is row-major with `room` columns. */
struct nav_joint {
    int count, room;
    double *mean, *cov;
};

/* A number that depends on few others, linearised: value = sum of slope[i] * state[index[i]] about the present mean. */
struct nav_linear {
    int terms;
    int index[12];
    double slope[12];
};

static inline void nav_linear_add(struct nav_linear *l, int index, double slope)
{
    l->index[l->terms] = index;
    l->slope[l->terms++] = slope;
}

/* The form `a` plus the form `b`. */
static inline struct nav_linear nav_linear_sum(const struct nav_linear *a, const struct nav_linear *b)
{
    struct nav_linear sum = *a;
    for (int n = 0; n < b->terms; n++)
        nav_linear_add(&sum, b->index[n], b->slope[n]);
    return sum;
}

/* Begins with the pose at the origin, known; nothing of the world is. */
void nav_joint_begin(struct nav_joint *, double distance_sigma, double turn_sigma);

/* Makes `to` equal; both have the same room. */
void nav_joint_copy(struct nav_joint *to, const struct nav_joint *from);

/* A row's motion as the wheels report it, with its noise. */
void nav_joint_move(struct nav_joint *, struct nav_pose step, struct nav_noise noise);

/* Variance of a linear form. */
double nav_joint_variance(const struct nav_joint *, const struct nav_linear *);

/* Corrects all by what was learned of a linear form, whose variance is `variance`: its mean shifts by `shift` and its
 * variance becomes `left`. */
void nav_joint_correct(struct nav_joint *, const struct nav_linear *, double variance, double shift, double left);

/* Kalman update: a measurement differs from the form by `innovation`, with this noise variance. */
void nav_joint_measure(struct nav_joint *, const struct nav_linear *, double innovation, double noise);

/* Adds a number: mean, and what it is of the state, plus independent noise. Returns its index. */
int nav_joint_add(struct nav_joint *, double mean, const struct nav_linear *, double noise);

/* Removes `count` numbers from `first` on. */
void nav_joint_remove(struct nav_joint *, int first, int count);

/* Sets a number afresh, correlated with nothing. */
void nav_joint_set(struct nav_joint *, int index, double mean, double variance);

#endif
