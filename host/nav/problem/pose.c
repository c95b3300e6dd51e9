#include "pose.h"

#include <math.h>

double nav_wrap(double angle)
{
    return remainder(angle, 2.0 * NAV_PI);
}

struct nav_pose nav_compose(struct nav_pose from, struct nav_pose step)
{
    double c = cos(from.theta), s = sin(from.theta);
    return (struct nav_pose){from.x + c * step.x - s * step.y, from.y + s * step.x + c * step.y,
                             from.theta + step.theta};
}
