#include <assert.h>
#include <stdbool.h>
#include <stdio.h>

#include "whisker/device.h"
#include "whisker/errors.h"
#include "whisker_protocol.h"

/* Frames: a packet holds two, 16 KiB sixty-four: what libusb hands to Linux in one piece. */
#define BATCH_MIN 2
#define BATCH_MAX 64
#define BATCH_DEFAULT 4
/* Words of a record on the node link. */
#define WORDS 4
#define WORD_BITS 16
#define OPTIONS (WHISKER_OPTION_TICK_IN | WHISKER_OPTION_FALLING | WHISKER_OPTION_EVERY_FRAME | WHISKER_OPTION_PATTERN)

static_assert(WHISKER_OPTION_TICK_IN == WHISKER_CONTROL_OPTION_TICK_IN &&
                  WHISKER_OPTION_FALLING == WHISKER_CONTROL_OPTION_FALLING &&
                  WHISKER_OPTION_EVERY_FRAME == WHISKER_CONTROL_OPTION_EVERY_FRAME &&
                  WHISKER_OPTION_PATTERN == WHISKER_CONTROL_OPTION_PATTERN,
              "the host's options are the wire's");

void whisker_settings_default(struct whisker_settings *settings)
{
    *settings = (struct whisker_settings){
        .lane_mask = (UINT32_C(1) << WHISKER_LIMIT_LANES) - 1,
        .tick_period = WHISKER_LIMIT_TICK_PERIOD,
        .sck_divider = WHISKER_LIMIT_SCK_DIVIDER_DEFAULT,
        .word_gap = WHISKER_LIMIT_WORD_GAP_DEFAULT,
        .sample_point = WHISKER_LIMIT_SAMPLE_POINT_DEFAULT,
        .batch = BATCH_DEFAULT,
    };
}

struct limit {
    const char *name;
    uint32_t value, min, max;
    bool even;
};

int whisker_settings_check(const struct whisker_settings *settings, char *message, size_t n)
{
    const struct limit limits[] = {
        {"tick period", settings->tick_period, WHISKER_LIMIT_TICK_PERIOD_MIN, UINT32_MAX, false},
        {"SCK divider", settings->sck_divider, WHISKER_LIMIT_SCK_DIVIDER_MIN, WHISKER_LIMIT_SCK_DIVIDER_MAX, true},
        {"word gap", settings->word_gap, WHISKER_LIMIT_WORD_GAP_MIN, UINT8_MAX, false},
        {"sample point", settings->sample_point, 1, settings->sck_divider, false},
        {"batch", settings->batch, BATCH_MIN, BATCH_MAX, true},
    };
    if (settings->lane_mask >> WHISKER_LIMIT_LANES != 0) {
        snprintf(message, n, "the lane mask 0x%x names more than lanes 0 to %d; use bits of 0x%x", settings->lane_mask,
                 WHISKER_LIMIT_LANES - 1, (1u << WHISKER_LIMIT_LANES) - 1);
        return WHISKER_ERROR_DEVICE_REFUSED;
    }
    if (settings->options & ~OPTIONS) {
        snprintf(message, n, "the options 0x%x have unknown bits; use bits of 0x%x", settings->options, OPTIONS);
        return WHISKER_ERROR_DEVICE_REFUSED;
    }
    for (size_t i = 0; i < sizeof limits / sizeof limits[0]; i++) {
        const struct limit *it = &limits[i];
        if (it->value < it->min || it->value > it->max || (it->even && it->value % 2 != 0)) {
            if (n > 0) {
                snprintf(message, n, "the %s is %u; it must be %s%u to %u", it->name, it->value,
                         it->even ? "even, " : "", it->min, it->max);
            }
            return WHISKER_ERROR_DEVICE_REFUSED;
        }
    }
    return WHISKER_OK;
}

int64_t whisker_settings_latency_ns(const struct whisker_settings *settings)
{
    const int64_t transfer = WORDS * WORD_BITS * settings->sck_divider + (WORDS - 1) * settings->word_gap;
    return (settings->tick_period + transfer) * INT64_C(1000000000) / WHISKER_LIMIT_CLOCK_HZ;
}
