/*
 * The clock mapping on synthetic traces whose delays and drifts are known: with start-of-frame packets and without, for
 * even ticks, for a bridge that is started again, and for ticks of a source that is off, uneven, or pauses. Prints
 * JSON: errors of the mapping at each arrival after the first five seconds, and how often its uncertainty covers them.
 * Usage: clock_bench SECONDS SEEDS
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "clock_trace.h"
#include "whisker/clock.h"

#define PER_SECOND 125
#define SETTLED (5 * PER_SECOND)
#define REPORT_EVERY 31 /* arrivals: four reports a second */
#define OTHER_SKEW 60e-6
#define OTHER_WANDER 2e-8 /* as the bridge's own */

enum dates { ARRIVALS, FRAMES, REPORTS, OTHER_CRYSTAL };

static const char *const dates_name[] = {"arrivals", "sof", "sof_report", "sof_report_other_crystal"};
static const struct scenario {
    const char *name;
    struct clock_source source;
} scenarios[] = {
    {"even", {.off = 0}},        {"restarts", {.restart_s = 60}}, {"off", {.off = 0.003}},
    {"uneven", {.uneven = 0.2}}, {"pauses", {.pause_s = 1}},
};

static int compare(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static struct whisker_clock map(struct whisker_clock_fit *fit, const struct clock_arrival *now, enum dates dates,
                                long i)
{
    struct whisker_clock clock;
    const uint16_t usb_time = dates == ARRIVALS ? 0 : now->usb_time;
    whisker_clock_add(fit, now->cycles, usb_time, now->arrival_ns, now->arrival_ns);
    if (dates >= REPORTS && i % REPORT_EVERY == 0) {
        whisker_clock_report(fit, now->cycles, now->usb_time, now->sof_cycles);
    }
    whisker_clock_get(fit, &clock);
    return clock;
}

static void run(const struct scenario *scenario, enum dates dates, long arrivals, unsigned seeds, double *error)
{
    long count = 0, covered = 0;
    for (unsigned seed = 1; seed <= seeds; seed++) {
        struct clock_trace trace;
        struct whisker_clock_fit fit;
        clock_trace_begin(&trace, seed);
        trace.source = scenario->source;
        trace.usb_skew = dates == OTHER_CRYSTAL ? OTHER_SKEW : 0;
        trace.usb_wander = dates == OTHER_CRYSTAL ? OTHER_WANDER : 0;
        whisker_clock_begin(&fit, TRACE_CLOCK_HZ, TRACE_LATENCY_NS);
        for (long i = 0; i < arrivals; i++) {
            const struct clock_arrival now = clock_trace_next(&trace);
            const struct whisker_clock clock = map(&fit, &now, dates, i);
            if (i >= SETTLED) {
                error[count] = fabs((double)clock.monotonic_ns - now.true_ns) * 1e-3;
                covered += error[count++] <= clock.uncertainty_ns * 1e-3;
            }
        }
    }
    qsort(error, (size_t)count, sizeof *error, compare);
    printf("{\"ticks\": \"%s\", \"dates\": \"%s\", \"median_us\": %.2f, \"p99_us\": %.2f, \"worst_us\": %.1f, "
           "\"covered\": %.5f}",
           scenario->name, dates_name[dates], error[count / 2], error[count * 99 / 100], error[count - 1],
           (double)covered / (double)count);
}

int main(int argc, char **argv)
{
    const long seconds = argc > 1 ? strtol(argv[1], NULL, 10) : 0;
    const unsigned seeds = argc > 2 ? (unsigned)strtoul(argv[2], NULL, 10) : 0;
    if (seconds <= SETTLED / PER_SECOND || seeds == 0) {
        fprintf(stderr, "clock_bench: give seconds, more than 5, and a number of seeds: clock_bench 3600 4\n");
        return 2;
    }
    double *error = calloc((size_t)seconds * PER_SECOND * seeds, sizeof *error);
    if (!error) {
        fprintf(stderr, "clock_bench: out of memory\n");
        return 1;
    }
    printf("[");
    for (size_t i = 0; i < sizeof scenarios / sizeof scenarios[0]; i++) {
        for (enum dates dates = ARRIVALS; dates <= OTHER_CRYSTAL; dates++) {
            printf("%s", i > 0 || dates > ARRIVALS ? ",\n " : "");
            run(&scenarios[i], dates, seconds * PER_SECOND, seeds, error);
        }
    }
    printf("]\n");
    free(error);
    return 0;
}
