/* Parts of the odometry: how a firmware treats remainders, and whether the body stands though it was asked to move. */
#ifndef CREATE_ODOMETRY_PARTS_H
#define CREATE_ODOMETRY_PARTS_H

#include "create/odometry.h"

/* What wheels do differs from what they were asked for by less than this share: the paper's 5 %, and some. */
#define ODOMETRY_SPREAD 0.07

/* What one frame was asked to drive, or reported, in the units of packets 19 and 20: mm, degrees. */
struct odometry_units {
    double distance, angle;
};

/* Look at one frame: what it was asked for against what it reported; exact: not in whole units, remainders dropped. */
void remainder_watch(struct create_odometry *odometry, const struct create_frame *frame, struct odometry_units asked);
void standing_watch(struct create_odometry *odometry, struct odometry_units asked, struct odometry_units reported,
                    bool exact);

#endif
