/* One answer from the two beliefs of the adaptive filter: what it says of them is of one time, the end of what is
 * pending. */
#ifndef NAV_ADAPTIVE_ANSWER_H
#define NAV_ADAPTIVE_ANSWER_H

#include "adaptive_global.h"
#include "adaptive_log.h"
#include "particle_bins.h"

/* What is held: one of the two at least. */
struct adaptive_held {
    const struct nav_problem *problem;
    const struct nav_particles *local;    /* NULL: not held */
    const struct adaptive_global *global; /* NULL: asleep */
    const struct adaptive_log *log;
    double share; /* probability that the robot is at another place than `local` has it: anywhere while `global` is
                     asleep, which is left out when it is too little to wake that */
};

/* Pose near which most is held at the end of the log. bins: the cloud's; guess: the answer before. */
struct nav_pose adaptive_answer_pose(const struct adaptive_held *, struct nav_bins *bins, struct nav_pose guess);

/* Fills pose, covariance and confidence. answer: that pose. */
void adaptive_answer_estimate(const struct adaptive_held *, struct nav_pose answer, const struct nav_pending *,
                              struct nav_estimate *);

/* Lists components as nav_filter_components does. */
long adaptive_answer_list(const struct adaptive_held *, struct nav_pose answer, const struct nav_pending *,
                          struct nav_component *out, long room);

#endif
