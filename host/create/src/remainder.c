#include <math.h>

#include "odometry.h"

#define UNIT_M 1e-3 /* of packet 19 */
/* The two ways to count must differ by this share of the distance before a distance tells them apart: more than the
 * wheels' own error of 5 % (paper), twice. */
#define CONTRAST 0.2
#define EVIDENCE_M 0.1

static bool straight_and_free(const struct create_frame *frame)
{
    return frame->missed == 0 && frame->value[CREATE_OI_BUMPS_DROPS] == 0 &&
           frame->value[CREATE_OI_REQUESTED_LEFT] == frame->value[CREATE_OI_REQUESTED_RIGHT];
}

static void forget(struct create_odometry *odometry)
{
    odometry->kept_m = odometry->dropped_m = odometry->told_m = 0;
}

/* A base that stands before a wall tells nothing either: less than a firmware that drops would tell is no evidence. */
static void judge(struct create_odometry *odometry)
{
    const double middle = (odometry->kept_m + odometry->dropped_m) / 2;
    if (odometry->told_m > middle) {
        odometry->remainder = CREATE_KEPT;
    } else if (odometry->told_m > odometry->dropped_m / 2) {
        odometry->remainder = CREATE_DROPPED;
    }
    forget(odometry);
}

void remainder_watch(struct create_odometry *odometry, const struct create_frame *frame, double asked_m)
{
    const double asked = fabs(asked_m);
    if (!straight_and_free(frame) || asked == 0) {
        forget(odometry);
        return;
    }
    odometry->kept_m += asked;
    odometry->dropped_m += floor(asked / UNIT_M) * UNIT_M;
    odometry->told_m += copysign(1, asked_m) * frame->value[CREATE_OI_DISTANCE] * UNIT_M;
    if (odometry->kept_m < EVIDENCE_M) {
        return;
    }
    if (odometry->kept_m - odometry->dropped_m >= CONTRAST * odometry->kept_m) {
        judge(odometry);
    } else {
        forget(odometry);
    }
}
