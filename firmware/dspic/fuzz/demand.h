/* What the fuzz targets of the sensors' decoders share. A broken promise traps. */
#ifndef FUZZ_DEMAND_H
#define FUZZ_DEMAND_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "sensor_frame.h"

static inline void demand(bool kept)
{
    if (!kept)
        __builtin_trap();
}

/* A reading that is not good says why, once, and carries no angle. False: it is good, but for error bits. */
static inline bool check_bad(const struct sensor_reading *reading)
{
    const unsigned code = (unsigned)reading->status >> WHISKER_STATUS_CODE_SHIFT;
    if (code == WHISKER_CODE_OK)
        return false;
    demand(code >= WHISKER_CODE_SENSOR_SUM && code <= WHISKER_CODE_SENSOR_ABSENT);
    demand(reading->status == code << WHISKER_STATUS_CODE_SHIFT);
    demand(reading->alpha == 0 && reading->beta == 0);
    return true;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

#endif
