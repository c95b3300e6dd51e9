#include "create/judge.h"

#include <math.h>

#define DRIVEN 1.1 /* times the greatest speed, or the one asked for: wheels of 10 % more than nominal */
/* A base that is pushed goes no faster than a person in haste, for as long as nobody notices that it is not heard. */
#define PUSHED_M_S 2.0
#define PUSHED_MOST_S 0.5
/* Few are pushed in a moment that is not heard; the fastest push is not beyond belief: so many sigma. */
#define PUSHED_SIGMAS 8

double create_wheel_way(const struct create_reach *reach, double distance, double angle)
{
    return fabs(distance) + fabs(angle) * reach->wheel_base_m / 2;
}

double create_driven_most(const struct create_reach *reach, double time_s)
{
    return DRIVEN * reach->speed_m_s * time_s;
}

double create_pushed_unseen(double time_s)
{
    return PUSHED_M_S / PUSHED_SIGMAS * fmin(time_s, PUSHED_MOST_S);
}

enum create_verdict create_judge(const struct create_reach *reach, double distance, double angle, double asked_m_s,
                                 double time_s)
{
    const double way_m = create_wheel_way(reach, distance, angle);
    const double pushed_m =
        PUSHED_M_S * fmin(time_s, PUSHED_MOST_S) + DRIVEN * fmin(asked_m_s, reach->speed_m_s) * time_s;
    return !(way_m <= pushed_m)                        ? CREATE_CARRIED
           : way_m > create_driven_most(reach, time_s) ? CREATE_PUSHED
                                                       : CREATE_DRIVEN;
}
