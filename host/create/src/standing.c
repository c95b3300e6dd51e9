/*
 * A body that was asked to move and does not.
 *
 * Every frame a body that moves as asked reports at least so many units: all but the wheels' error where remainders are
 * kept, whole units of that otherwise. What is missing of this is summed up; every reported unit cancels two, so that
 * only less than half of it lets the sum grow. Where the firmware drops remainders, or may, and less than a unit is
 * asked for, nothing is missing: a body that stands cannot be distinguished from one that moves.
 */
#include <math.h>

#include "odometry.h"

#define PATIENCE 3 /* frames' worth, or units if that is more */
#define PAYS 2

static double standing_least(double asked, bool exact)
{
    const double units = fabs(asked) * (1 - ODOMETRY_SPREAD);
    return exact ? units : floor(units);
}

/* Units reported in the direction that was asked for. */
static double standing_paid(double asked, double reported)
{
    return asked > 0 ? reported : asked < 0 ? -reported : 0;
}

void standing_watch(struct create_odometry *odometry, struct odometry_units asked, struct odometry_units reported,
                    bool exact)
{
    const double expected = standing_least(asked.distance, exact) + standing_least(asked.angle, exact);
    const double limit = PATIENCE * fmax(1, expected);
    if (expected <= 0) {
        odometry->missing = 0;
        odometry->standing = asked.distance != 0 || asked.angle != 0 ? CREATE_CANNOT_TELL : CREATE_MOVES;
        return;
    }
    const double got = standing_paid(asked.distance, reported.distance) + standing_paid(asked.angle, reported.angle);
    odometry->missing = fmin(limit, fmax(0, odometry->missing + expected - PAYS * got));
    odometry->standing = odometry->missing >= limit ? CREATE_STANDS : CREATE_MOVES;
}
