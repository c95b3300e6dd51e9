/* One answer from the two beliefs of the adaptive filter. */
#ifndef NAV_ADAPTIVE_ANSWER_H
#define NAV_ADAPTIVE_ANSWER_H

#include "adaptive_global.h"
#include "adaptive_log.h"
#include "particle_bins.h"

/* What is held: one of the two at least. */
struct adaptive_held {
    const struct nav_problem *problem;
    const struct nav_gaussian *gaussian; /* in the place of particles; NULL: not held */
    const struct nav_particles *local;   /* NULL: not held */
    struct nav_bins *bins;
    const struct adaptive_global *global; /* NULL: asleep */
    const struct adaptive_log *log;
    double share; /* probability that the robot is at another place than `local` has it */
};

/* Pose near which most is held, covariance of both beliefs about it and mass near it. guess: the answer before. */
struct nav_summary adaptive_answer(const struct adaptive_held *, struct nav_pose guess);

#endif
