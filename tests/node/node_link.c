/* node_link TICKS DIVIDER GAP PERIOD: a node at these link settings (cycles of 60 MHz), one of each kind of parts: chip
 * 4 % slow, nominal, 4 % quick; sensor 10 % slow, nominal, quick; a slave that prefetches one word or two; DMA at once
 * or 12 cycles late. Writes how many records were lost of how many, in all and with the worst parts. The settings may
 * lie beyond the bridge's limits. */
#include <stdio.h>
#include <stdlib.h>

#include "lane_bench.h"

enum { CHIPS = 3, SENSORS = 3, PREFETCHES = 2, DMAS = 2, PARTS = CHIPS * SENSORS * PREFETCHES * DMAS, FIRST = 2 };

struct run {
    unsigned ticks, lost;
};

static bool node_link_plan(void *context, unsigned tick, struct sim_field *field, struct lane_faults *faults)
{
    (void)faults;
    *field = (struct sim_field){0.1 * (tick % 300u), -0.1 * (tick % 200u)};
    return tick < ((const struct run *)context)->ticks + FIRST;
}

static void node_link_judged(void *context, unsigned tick, const struct lane_verdict *v)
{
    struct run *run = context;
    run->lost += tick >= FIRST && (!v->good || v->altered);
}

static struct sim_node_parameters node_link_parts_of(unsigned n)
{
    struct sim_node_parameters parts;
    sim_node_parameters_default(&parts, n);
    parts.chip.frc_ppm = ((int32_t)(n % CHIPS) - 1) * 40000;
    parts.sensor.slow_permille = (uint16_t)(900u + n / CHIPS % SENSORS * 100u);
    parts.chip.slave_prefetch = (uint8_t)(1u + n / (CHIPS * SENSORS) % PREFETCHES);
    parts.chip.dma_cycles = n / (CHIPS * SENSORS * PREFETCHES) ? 12 : 0;
    return parts;
}

static unsigned node_link_lost_with(unsigned n, unsigned ticks, struct lane_timing timing)
{
    struct run run = {.ticks = ticks};
    struct lane_bench bench;
    const struct sim_node_parameters parts = node_link_parts_of(n);
    sim_node *node = sim_node_new_as(&parts);
    if (!node)
        return ticks;
    sim_node_power_on(node);
    lane_bench_start(&bench, node, timing);
    lane_bench_run(&bench, &(struct lane_world){&run, node_link_plan, node_link_judged});
    sim_node_free(node);
    return run.lost;
}

int main(int argc, char **argv)
{
    unsigned settings[4], lost = 0, worst = 0;
    if (argc != 5) {
        fprintf(stderr, "node_link: wants ticks, divider, gap and period\n");
        return 2;
    }
    for (int i = 0; i < 4; i++)
        settings[i] = (unsigned)strtoul(argv[1 + i], NULL, 10);
    for (unsigned n = 0; n < PARTS; n++) {
        const unsigned one = node_link_lost_with(n, settings[0], lane_timing_of(settings[1], settings[2], settings[3]));
        lost += one;
        worst = one > worst ? one : worst;
    }
    printf("%u %u %u %u\n", lost, PARTS * settings[0], worst, settings[0]);
    return 0;
}
