/* image_check vectors|boots N|resets: what the image does where no record shows it, as JSON.
 *
 * vectors: each interrupt and trap raised, in the application and in the loader: "returns" or "restarts".
 * boots: N supplies that come on with random memory: ticks until good records.
 * resets: each cause, on chips that keep their oscillator over a reset and on others: what the records hold, the clock
 * before and after, ticks lost. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "dspic_chip.h"
#include "image_port.h"
#include "lane_bench.h"
#include "sim_node_state.h"
#include "whisker_protocol.h"

static const uint64_t MS_FS = UINT64_C(1000000000000);

enum { TRAPS = 8 }; /* vectors before the first interrupt's */

/* ------------------------------------------------------------------------------------------------------------ vectors
 */

static sim_node *image_check_started(bool in_loader)
{
    sim_node *node = sim_node_new(1);
    if (!node)
        exit(2);
    for (unsigned i = 0; in_loader && i < FLASH_ROW_WORDS; i++) /* no header: no application */
        dspic_flash(node->chip)[WHISKER_LIMIT_APPLICATION_ROW * FLASH_ROW_WORDS + i] = UINT32_C(0xFFFFFF);
    sim_node_power_on(node);
    return node;
}

static void image_check_raise_interrupt(struct dspic *chip, unsigned irq)
{
    registers_write(chip, IEC0 + 2u * (irq / 16u),
                    (uint16_t)(registers_read(chip, IEC0 + 2u * (irq / 16u)) | 1u << irq % 16u));
    dspic_irq_raise(chip, irq);
}

static const char *image_check_outcome(const struct image_costs *before, unsigned number)
{
    const struct image_costs after = image_port_costs();
    if (after.boots > before->boots)
        return "restarts";
    return after.returned[number] > before->returned[number] ? "returns" : "nothing";
}

static const char *image_check_tried(bool in_loader, unsigned number)
{
    sim_node *node = image_check_started(in_loader);
    const struct image_costs before = image_port_costs();
    if (number < TRAPS)
        sim_node_disturb(node, SIM_NODE_TRAP, number);
    else
        image_check_raise_interrupt(node->chip, number - TRAPS);
    sim_node_until(node, sim_node_fs(node) + MS_FS);
    const char *found = image_check_outcome(&before, number);
    sim_node_free(node);
    return found;
}

static void image_check_print_vector(bool in_loader, unsigned number)
{
    const bool none = number < TRAPS && number > (unsigned)DSPIC_TRAP_DMA;
    printf("%s\"%s\"", number ? ", " : "", none ? "none" : image_check_tried(in_loader, number));
}

static void image_check_print_vectors(void)
{
    for (unsigned in_loader = 0; in_loader < 2u; in_loader++) {
        printf("%s\"%s\": [", in_loader ? ", " : "{", in_loader ? "loader" : "application");
        for (unsigned number = 0; number < IMAGE_VECTORS; number++)
            image_check_print_vector(in_loader != 0, number);
        printf("]");
    }
    printf("}\n");
}

/* --------------------------------------------------------------------------------------------------------------- runs
 */

enum { CALM = 5, LONGEST = 400, RUN = 20 };

struct run {
    struct lane_faults fault; /* of tick CALM */
    unsigned good;            /* records in a row */
    unsigned lost;
    bool ended;
    uint32_t reported; /* codes, as bits */
    unsigned altered;
};

static bool image_check_plan(void *context, unsigned tick, struct sim_field *field, struct lane_faults *faults)
{
    struct run *run = context;
    *field = (struct sim_field){0.25 * (tick % 80u), 7.0 - 0.125 * (tick % 60u)};
    if (tick == CALM)
        *faults = run->fault;
    return !run->ended && tick < LONGEST;
}

static void image_check_judged(void *context, unsigned tick, const struct lane_verdict *v)
{
    struct run *run = context;
    run->good = v->good ? run->good + 1u : 0u;
    run->altered += v->altered;
    if (tick == 0)
        return;
    run->lost += !v->good;
    run->reported |= v->code < 32u ? UINT32_C(1) << v->code : 0u;
    run->ended = tick > CALM && run->good >= RUN;
}

static struct run image_check_run_with(const struct lane_faults *fault, bool keeps_clock, uint64_t seed, uint32_t hz[2])
{
    static struct lane_bench bench;
    struct run run = {.fault = *fault};
    struct sim_node_parameters parts;
    sim_node_parameters_default(&parts, seed);
    parts.chip.keeps_clock = keeps_clock;
    sim_node *node = sim_node_new_as(&parts);
    if (!node)
        exit(2);
    sim_node_power_on(node);
    hz[0] = sim_node_report(node).fcy_hz;
    lane_bench_start(&bench, node, lane_timing_of(16, 180, LANE_TICK_PERIOD));
    lane_bench_run(&bench, &(struct lane_world){&run, image_check_plan, image_check_judged});
    hz[1] = sim_node_report(node).fcy_hz;
    run.altered += sim_node_violations(node) - sim_node_report(node).overwritten;
    sim_node_free(node);
    return run;
}

static void image_check_print_boots(unsigned count)
{
    printf("[");
    for (unsigned seed = 0; seed < count; seed++) {
        uint32_t hz[2];
        const struct run run = image_check_run_with(&(struct lane_faults){0}, seed % 2u, seed, hz);
        printf("%s{\"good\": %s, \"lost\": %u, \"breaches\": %u}", seed ? ", " : "", run.ended ? "true" : "false",
               run.lost, run.altered);
    }
    printf("]\n");
}

static void image_check_print_resets(void)
{
    static const struct {
        const char *name;
        struct lane_faults fault;
    } CAUSES[] = {
        {"reset pin", {.disturbance = SIM_NODE_RESET, .disturbance_argument = RCON_EXTR}},
        {"brown-out", {.disturbance = SIM_NODE_RESET, .disturbance_argument = RCON_BOR}},
        {"reset instruction", {.disturbance = SIM_NODE_RESET, .disturbance_argument = RCON_SWR}},
        {"illegal opcode", {.disturbance = SIM_NODE_RESET, .disturbance_argument = RCON_IOPUWR}},
        {"trap", {.disturbance = SIM_NODE_TRAP, .disturbance_argument = DSPIC_TRAP_ADDRESS}},
        {"watchdog", {.disturbance = SIM_NODE_HANG}},
    };
    printf("[");
    for (unsigned i = 0; i < 2u * (sizeof CAUSES / sizeof *CAUSES); i++) {
        uint32_t hz[2];
        struct lane_faults fault = CAUSES[i / 2u].fault;
        fault.disturbance_ns = 250000;
        const struct run run = image_check_run_with(&fault, i % 2u, 1, hz);
        printf("%s{\"cause\": \"%s\", \"keeps_clock\": %s, \"good\": %s, \"lost\": %u, \"reported\": %lu, "
               "\"breaches\": %u, "
               "\"hz\": [%lu, %lu]}",
               i ? ",\n " : "", CAUSES[i / 2u].name, i % 2u ? "true" : "false", run.ended ? "true" : "false", run.lost,
               (unsigned long)run.reported, run.altered, (unsigned long)hz[0], (unsigned long)hz[1]);
    }
    printf("]\n");
}

int main(int argc, char **argv)
{
    if (argc == 2 && strcmp(argv[1], "vectors") == 0) {
        image_check_print_vectors();
    } else if (argc == 3 && strcmp(argv[1], "boots") == 0) {
        image_check_print_boots((unsigned)strtoul(argv[2], NULL, 10));
    } else if (argc == 2 && strcmp(argv[1], "resets") == 0) {
        image_check_print_resets();
    } else {
        fprintf(stderr, "image_check: wants vectors, boots and how many, or resets\n");
        return 2;
    }
    return 0;
}
