/* Comparison of doubles; include cmocka's headers first. */
#ifndef MECH_TEST_NEAR_H
#define MECH_TEST_NEAR_H

#include <math.h>

#include "whisker_constants.h"

/* NaN is never near. */
#define assert_near(got, wanted, tolerance)                                                                            \
    do {                                                                                                               \
        double got_ = (got), wanted_ = (wanted);                                                                       \
        if (!(fabs(got_ - wanted_) <= (tolerance)))                                                                    \
            fail_msg("%s is %.9g, wanted %.9g +- %.3g", #got, got_, wanted_, (double)(tolerance));                     \
    } while (0)

#define assert_share(got, wanted, share) assert_near(got, wanted, (share)*fabs(wanted))

#define COUNT(list) (sizeof(list) / sizeof((list)[0]))
#define TICK SIM_TICK_S

#endif
