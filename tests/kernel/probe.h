/* What the guest's small programs share: how a probe says that something is not as it should be, and the report that
 * starts and stops the bridge. */
#pragma once

#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include "whisker_protocol.h"

/* One line on standard error, and exit code 1. */
__attribute__((noreturn, format(printf, 1, 2))) static inline void fail(const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    vfprintf(stderr, format, arguments);
    va_end(arguments);
    fputc('\n', stderr);
    exit(EXIT_FAILURE);
}

/* Fills in WHISKER_REPORT_CONTROL_BYTES bytes: all lanes, the paper's rate, the fastest link settings. */
static inline void control_report(uint8_t *report, uint8_t version, uint8_t run)
{
    for (unsigned at = 0; at < WHISKER_REPORT_CONTROL_BYTES; at++) {
        report[at] = 0;
    }
    report[WHISKER_REPORT_CONTROL_ID] = WHISKER_REPORT_ID_CONTROL;
    report[WHISKER_REPORT_CONTROL_WIRE_VERSION] = version;
    report[WHISKER_REPORT_CONTROL_RUN] = run;
    report[WHISKER_REPORT_CONTROL_SCK_DIVIDER] = WHISKER_LIMIT_SCK_DIVIDER_MIN;
    report[WHISKER_REPORT_CONTROL_WORD_GAP] = WHISKER_LIMIT_WORD_GAP_MIN;
    report[WHISKER_REPORT_CONTROL_SAMPLE_POINT] = WHISKER_LIMIT_SCK_DIVIDER_MIN - 1;
    whisker_put_u32(report + WHISKER_REPORT_CONTROL_LANE_MASK, (UINT32_C(1) << WHISKER_LIMIT_LANES) - 1);
    whisker_put_u32(report + WHISKER_REPORT_CONTROL_TICK_PERIOD, WHISKER_LIMIT_TICK_PERIOD);
}
