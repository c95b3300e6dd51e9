#include "mech_static.h"

double mech_static_moment(const struct mech_whisker *whisker, double a, double theta)
{
    double bending = a * whisker->cone / (3 * mech_whisker_bending(whisker) * (whisker->cone - a));
    return theta / (mech_whisker_compliance(whisker) + bending);
}

double mech_static_tilt(const struct mech_whisker *whisker, double a, double theta)
{
    return mech_whisker_compliance(whisker) * mech_static_moment(whisker, a, theta);
}

double mech_static_stiffness(const struct mech_whisker *whisker, double a)
{
    return 3 * mech_whisker_bending(whisker) * (1 - a / whisker->cone) / (a * a * a);
}
