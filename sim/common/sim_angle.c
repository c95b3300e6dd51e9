#include "sim_angle.h"

#include <math.h>

double sim_wrap(double angle)
{
    while (angle > SIM_PI)
        angle -= 2 * SIM_PI;
    while (angle <= -SIM_PI)
        angle += 2 * SIM_PI;
    return angle;
}
