/* The last contacts, carried along in the robot's frame by its odometry: what a new face is made of. */
#ifndef NAV_TOUCHES_H
#define NAV_TOUCHES_H

#include <limits.h>
#include <stdbool.h>
#include <stdint.h>

#include "motion.h"

enum { NAV_TOUCHES_MOST = CHAR_BIT * sizeof(uint64_t) }; /* a bit each */

/* A contact: its point and the whisker's direction in the robot's frame now. */
struct nav_touch {
    double x, y, along_x, along_y;
    double variance;   /* m^2 of the point, odometry since then included */
    double turned;     /* rad^2, of directions since then */
    double normal;     /* direction of the face's outward normal, robot's frame; NAN: not reported */
    double normal_var; /* rad^2 */
};

struct nav_touches {
    struct nav_touch touch[NAV_TOUCHES_MOST];
    uint64_t held; /* a bit for each place in use */
    int next;
};

/* Carries all along; contacts whose place has become too uncertain are left out. */
void nav_touches_move(struct nav_touches *, struct nav_pose step, struct nav_noise noise);

/* Keeps a contact in place of the oldest; returns its place. */
int nav_touches_keep(struct nav_touches *, struct nav_touch touch);

/* A straight line through some contacts, robot's frame. */
struct nav_touches_line {
    double normal, x, y;           /* direction toward the robot's side; a point on it amid the contacts */
    double normal_var, offset_var; /* rad^2; m^2 along the normal */
    double span;                   /* m between the outermost contacts */
    uint64_t used;                 /* a bit for each contact on it */
};

/* How many are in a set. */
int nav_touches_count(uint64_t set);

/* Finds the line through contact `at` that most of the contacts in `among` lie on; where too few do, the line by the
 * normal that was reported with the contact. False: neither is known. */
bool nav_touches_fit(const struct nav_touches *, int at, uint64_t among, struct nav_touches_line *out);

#endif
