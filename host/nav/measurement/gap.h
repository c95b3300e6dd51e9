/* What the robot did in rows that never came.
 *
 * Their odometry is lost with them. A robot mostly goes on as it did: between rows alike, a missing one was like them,
 * and where they differ it was like one of the two. A row whose odometry is as long as all the missing ones' together
 * has counted them itself. Should a missing row come late, what was assumed for it is taken back. */
#ifndef NAV_GAP_H
#define NAV_GAP_H

#include "motion.h"

enum { NAV_GAPS_KEPT = 16 };

struct nav_gap {
    double from_s, until_s; /* times of the rows around it */
    struct nav_pose each;   /* motion assumed for each missing row */
    int missing;            /* rows that have not come since */
};

struct nav_gaps {
    double period_s; /* running median of the time between rows */
    struct nav_pose last;
    double usual_m, usual_rad; /* running means of a row's distance and turn */
    struct nav_gap kept[NAV_GAPS_KEPT];
    unsigned count; /* gaps ever kept */
};

void nav_gaps_init(struct nav_gaps *);

/* How many rows are missing between two times, at most 100. Learns how far apart rows are. */
int nav_gaps_missing(struct nav_gaps *, double from_s, double until_s);

/* The motion of a row after `missing` ones between these times. step: its odometry, NULL when that cannot be read. */
struct nav_motion nav_gaps_bridge(struct nav_gaps *, const struct nav_pose *step, int missing, double from_s,
                                  double until_s);

/* What a row that comes late adds to what was assumed. */
struct nav_motion nav_gaps_fill(struct nav_gaps *, struct nav_pose step, double t_s);

#endif
