/*
 * libFuzzer target: whatever times a bridge claims and however the host's clocks run or jump, the mapping stays finite.
 * Input: per arrival 8 bytes of cycles (steps, or a jump anywhere) and 4 of host time.
 */
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "whisker/clock.h"

#define ARRIVAL_BYTES 12
#define NS_PER_UNIT 4096 /* a step of the host's clock: up to 8.8 s either way */
#define START_NS INT64_C(1000000000000)

static void check(const struct whisker_clock_fit *fit, uint64_t cycles)
{
    struct whisker_clock clock;
    whisker_clock_get(fit, &clock);
    const int finite = isfinite(clock.ns_per_cycle) && isfinite(clock.uncertainty_ns) && clock.uncertainty_ns >= 0 &&
                       clock.ns_per_cycle > 16 && clock.ns_per_cycle < 17;
    whisker_clock_to_monotonic(&clock, cycles);
    whisker_clock_to_realtime(&clock, ~cycles);
    if (!finite) {
        abort();
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct whisker_clock_fit fit;
    uint64_t cycles = 0;
    int64_t now_ns = START_NS;
    whisker_clock_begin(&fit, 60000000, 500000);
    for (; size >= ARRIVAL_BYTES; data += ARRIVAL_BYTES, size -= ARRIVAL_BYTES) {
        uint64_t number;
        int32_t step;
        memcpy(&number, data, sizeof number);
        memcpy(&step, data + sizeof number, sizeof step);
        cycles = number & 1 ? number : cycles + (number >> 1) % 480000000;
        now_ns += (int64_t)step * NS_PER_UNIT;
        const uint16_t usb_time = (uint16_t)(number & 4 ? number >> 8 | 0x8000 : 0);
        whisker_clock_add(&fit, cycles, usb_time, now_ns, now_ns * (number & 2 ? -1 : 1));
        check(&fit, number);
        whisker_clock_report(&fit, cycles, (uint16_t)(number >> 24), (uint16_t)(number >> 40));
        check(&fit, ~number);
    }
    return 0;
}
