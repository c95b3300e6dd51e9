/* node_records TICKS SEED: a node under random fields and faults, one line per tick: the record as it was
 * read, and the bridge's verdict; at last the node's counters. Built twice, with the firmware's C and with its image:
 * both must write the same. Only what does not depend on the cycles of the firmware is broken: the sensor's frames,
 * bits of the link, clocks that are missing; no reset, no SYNC at a wrong time, no clock too many, in whose midst the
 * link is armed. */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

#include "lane_bench.h"
#include "sim_rng.h"
#include "whisker_protocol.h"

struct run {
    uint64_t random;
    unsigned ticks;
    struct sim_field field;
};

static uint32_t node_records_below(struct run *run, uint32_t n)
{
    return (uint32_t)((sim_rng_mix(&run->random) >> 32) * n >> 32);
}

static double node_records_walk(struct run *run, double angle_deg)
{
    const double by = 16.0 * (double)node_records_below(run, 1u << 20) / (1u << 20) - 8.0;
    return angle_deg + by > 60.0 || angle_deg + by < -60.0 ? angle_deg - by : angle_deg + by;
}

static void node_records_break_sensor(struct run *run, struct lane_faults *f)
{
    f->sensor = (enum sim_sensor_fault)(SIM_SENSOR_FLIP_BIT + node_records_below(run, SIM_SENSOR_EXTRA_CLOCK));
    f->sensor_argument = node_records_below(run, 64);
    if (f->sensor == SIM_SENSOR_ERROR_BITS)
        f->sensor_argument = node_records_below(run, 1u << 16);
    else if (f->sensor == SIM_SENSOR_FLIP_TWO)
        f->sensor_argument += 256u * node_records_below(run, 64);
    else if (f->sensor == SIM_SENSOR_NOISY)
        f->sensor_argument = 1000u;
}

static void node_records_break_link(struct run *run, struct lane_faults *f)
{
    switch (node_records_below(run, 5)) {
    case 0:
        f->mosi_flips = sim_rng_mix(&run->random);
        break;
    case 1:
        f->mosi_flips = UINT64_C(1) << node_records_below(run, 64);
        break;
    case 2:
        f->extra_clocks = -1 - (int32_t)node_records_below(run, 40);
        break;
    case 3:
        f->no_sync = true;
        break;
    default:
        f->no_select = true;
        break;
    }
}

static bool node_records_plan(void *context, unsigned tick, struct sim_field *field, struct lane_faults *faults)
{
    struct run *run = context;
    run->field =
        (struct sim_field){node_records_walk(run, run->field.alpha_deg), node_records_walk(run, run->field.beta_deg)};
    *field = run->field;
    switch (node_records_below(run, 24)) {
    case 0:
        node_records_break_sensor(run, faults);
        break;
    case 1:
        node_records_break_link(run, faults);
        break;
    default:
        break;
    }
    return tick < run->ticks;
}

static void node_records_judged(void *context, unsigned tick, const struct lane_verdict *v)
{
    (void)context;
    printf("%u %016" PRIx64 " %u%s%s\n", tick, v->read, v->code, v->good ? " good" : "", v->altered ? " altered" : "");
}

int main(int argc, char **argv)
{
    if (argc != 3) {
        fprintf(stderr, "node_records: wants how many ticks, and a seed\n");
        return 2;
    }
    struct run run = {.ticks = (unsigned)strtoul(argv[1], NULL, 10), .random = strtoull(argv[2], NULL, 10)};
    struct sim_node_parameters parts;
    static struct lane_bench bench;
    sim_node_parameters_default(&parts, sim_rng_mix(&run.random));
    parts.chip.slave_prefetch = (uint8_t)(1u + node_records_below(&run, 2));
    parts.chip.dma_cycles = (uint8_t)node_records_below(&run, 13);
    parts.chip.frc_ppm = (int32_t)node_records_below(&run, 40001) - 20000;
    sim_node *node = sim_node_new_as(&parts);
    if (!node)
        return 2;
    sim_node_power_on(node);
    lane_bench_start(&bench, node, lane_timing_of(16, 180, LANE_TICK_PERIOD));
    lane_bench_run(&bench, &(struct lane_world){&run, node_records_plan, node_records_judged});
    for (unsigned i = 0; i < WHISKER_HEALTH_COUNT; i++)
        printf("%u%s", sim_node_counted(node, i), i + 1u < WHISKER_HEALTH_COUNT ? " " : "\n");
    printf("breaches %u\n", sim_node_violations(node));
    sim_node_free(node);
    return 0;
}
