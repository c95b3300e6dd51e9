#include "sim_counts.h"

#define STEPS 4096     /* 12 bits */
#define STEP_COUNTS 16 /* 65536 / STEPS */
#define SPAN_DEG 180.0

uint16_t sim_counts(double field_deg)
{
    const double step = STEPS / 2 + field_deg * (STEPS / SPAN_DEG);
    if (!(step > 0.0))
        return 0;
    if (step >= STEPS - 1)
        return (STEPS - 1) * STEP_COUNTS;
    return (uint16_t)((unsigned)(step + 0.5) * STEP_COUNTS);
}
