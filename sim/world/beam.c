#include "beam.h"

#include "whisker_constants.h"

static double three_ei(void)
{
    return 3 * SIM_WHISKER_E * SIM_WHISKER_I0;
}

double sim_beam_stiffness(double a)
{
    return three_ei() * (1 - a / SIM_WHISKER_CONE_M) / (a * a * a);
}

double sim_beam_plug_stiffness(double kappa)
{
    return kappa * three_ei() / SIM_WHISKER_CONE_M;
}

double sim_beam_moment(double a, double theta, double kappa)
{
    double bending = a * SIM_WHISKER_CONE_M / (three_ei() * (SIM_WHISKER_CONE_M - a));
    return theta / (1 / sim_beam_plug_stiffness(kappa) + bending);
}

double sim_beam_moment_clamped(double a, double theta)
{
    return three_ei() * theta * (1 / a - 1 / SIM_WHISKER_CONE_M);
}

double sim_beam_tilt(double a, double theta, double kappa)
{
    double x = a / SIM_WHISKER_CONE_M;
    return theta * (1 - x) / (1 - x + kappa * x);
}
