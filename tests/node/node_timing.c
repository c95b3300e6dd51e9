/* node_timing TICKS NODES FRC_PPM SENSOR_PERMILLE CONVERSION_NS SEED: nodes whose oscillators are drawn within those
 * spreads, side by side on one SYNC. One line per node and tick: from SYNC to the sensor's latch, age of its conversion
 * then, from SYNC to the armed record, all ns. At the end a line "cycles": per tick in interrupts, and interrupts per
 * tick, of the first node. A FRC_PPM below 0 is no spread: all nodes are off by as much. */
#include <stdio.h>
#include <stdlib.h>

#include "lane_bench.h"
#include "sim_rng.h"
#include "whisker_protocol.h"

struct run {
    unsigned ticks;
    struct sim_node_report first, last;
};

static bool node_timing_plan(void *context, unsigned tick, struct sim_field *field, struct lane_faults *faults)
{
    (void)faults;
    *field = (struct sim_field){0.01 * (tick % 1000u), 0.0};
    return tick <= ((const struct run *)context)->ticks + 1u;
}

static double node_timing_ns_since(uint64_t fs, uint64_t since_fs)
{
    return ((double)fs - (double)since_fs) * 1e-6;
}

static void node_timing_judged(void *context, unsigned tick, const struct lane_verdict *v)
{
    struct run *run = context;
    if (tick == 1)
        run->first = v->report;
    run->last = v->report;
    if (tick > 1)
        printf("%.1f %.1f %.1f\n", node_timing_ns_since(v->report.latch_fs, v->sync_fs),
               (double)v->report.age_fs * 1e-6, node_timing_ns_since(v->report.armed_fs, v->sync_fs));
}

/* A number from -1 to 1. */
static double node_timing_spread(uint64_t *random)
{
    return (double)(sim_rng_mix(random) >> 11) / 4503599627370496.0 - 1.0;
}

static bool node_timing_run_node(struct run *run, const struct sim_node_parameters *parts)
{
    struct lane_bench bench;
    sim_node *node = sim_node_new_as(parts);
    if (!node)
        return false;
    sim_node_power_on(node);
    lane_bench_start(&bench, node, lane_timing_of(16, 180, WHISKER_LIMIT_TICK_PERIOD));
    lane_bench_run(&bench, &(struct lane_world){run, node_timing_plan, node_timing_judged});
    sim_node_free(node);
    return true;
}

static void node_timing_print_cycles(const struct run *run)
{
    const double busy_s = (double)(run->last.busy_fs - run->first.busy_fs) * 1e-15;
    const double interrupts = (double)(run->last.interrupts - run->first.interrupts);
    printf("cycles %.1f %.2f\n", busy_s * run->last.fcy_hz / run->ticks, interrupts / run->ticks);
}

int main(int argc, char **argv)
{
    if (argc != 7) {
        fprintf(stderr, "node_timing: wants ticks, nodes, ppm, permille, ns and a seed\n");
        return 2;
    }
    struct run run = {.ticks = (unsigned)atoi(argv[1])};
    uint64_t random = strtoull(argv[6], NULL, 10);
    const double ppm = atof(argv[3]), permille = atof(argv[4]);
    for (int n = 0; n < atoi(argv[2]); n++) {
        struct sim_node_parameters parts;
        sim_node_parameters_default(&parts, (uint64_t)n + 1u);
        const double chip = node_timing_spread(&random), sensor = node_timing_spread(&random);
        parts.chip.frc_ppm = (int32_t)(ppm < 0.0 ? ppm : chip * ppm);
        parts.chip.slave_prefetch = (uint8_t)(1 + n % 2);
        parts.sensor.slow_permille = (uint16_t)(1000.0 + sensor * permille);
        parts.sensor.conversion_ns = (uint32_t)atoi(argv[5]);
        if (!node_timing_run_node(&run, &parts))
            return 1;
        if (n == 0)
            node_timing_print_cycles(&run);
    }
    return 0;
}
