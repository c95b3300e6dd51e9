/* Runs a case of the fault matrix and writes down the verdicts, and the node's own counters beside them. */
#define _POSIX_C_SOURCE 200809L
#include <regex.h>
#include <stdio.h>
#include <string.h>

#include "fault_matrix.h"
#include "whisker_protocol.h"

enum { LONGEST = 1000 };

static char fault_run_letter(const struct lane_verdict *v)
{
    static const char CODES[] = ".SRLx0ajPWT??O";
    switch (v->code) {
    case WHISKER_CODE_OK:
        return v->status == 0 ? '.' : 'e';
    case WHISKER_CODE_ABSENT:
        return '-';
    case WHISKER_CODE_LINK_CRC:
        return 'c';
    case WHISKER_CODE_LINK_TICK:
        return 't';
    default:
        return v->code < sizeof CODES - 1u ? CODES[v->code] : '?';
    }
}

struct sim_node_parameters fault_parts(unsigned n)
{
    struct sim_node_parameters parts;
    sim_node_parameters_default(&parts, n);
    parts.chip.slave_prefetch = (uint8_t)(1u + n % 2u);
    parts.chip.dma_cycles = 8;
    parts.chip.frc_ppm = ((int32_t)(n / 2u) - 1) * 20000;
    parts.sensor.slow_permille = (uint16_t)(900u + n / 2u * 100u);
    return parts;
}

static struct sim_field fault_run_field_of(const struct fault_case *row, unsigned tick)
{
    struct sim_field field = {0.5 * (tick % 40u), -12.0 + 0.25 * (tick % 60u)};
    if (row->field)
        row->field(tick, &field);
    return field;
}

static void fault_run_append(char text[FAULT_TEXT], char c, unsigned run)
{
    const size_t at = strlen(text);
    if (run > 9u) {
        snprintf(text + at, FAULT_TEXT - at, "%c%u", c, run);
        return;
    }
    for (unsigned i = 0; i < run && at + i + 1u < FAULT_TEXT; i++)
        text[at + i] = c;
}

/* `letters[0]` is the verdict on the record that the broken tick brought. */
static void fault_run_summarise(struct fault_outcome *out, const char *letters, unsigned last)
{
    unsigned run = 0;
    for (unsigned i = 0; i < last; i++) {
        const char c = letters[i];
        out->lost += c != '.';
        if (c != '.' && out->detected_after < 0)
            out->detected_after = (int)i;
        run++;
        if (i + 1u == last || letters[i + 1u] != c) {
            fault_run_append(out->verdicts, c, run);
            run = 0;
        }
    }
}

static bool fault_run_matches(const char *expected, const char *text)
{
    regex_t pattern;
    if (regcomp(&pattern, expected, REG_EXTENDED | REG_NOSUB) != 0)
        return false;
    const bool yes = regexec(&pattern, text, 0, NULL, 0) == 0;
    regfree(&pattern);
    return yes;
}

static void fault_run_compare_counters(struct fault_outcome *out, const struct fault_case *row, const sim_node *node,
                                       const char *letters)
{
    char reported[FAULT_TEXT];
    fault_counted(node, out->counted);
    fault_reported(letters, reported);
    out->counted_as_expected =
        row->counted ? fault_run_matches(row->counted, out->counted) : strcmp(reported, out->counted) == 0;
}

struct run {
    const struct fault_case *row;
    struct fault_outcome *out;
    char letters[LONGEST + 1];
    unsigned good, last;
};

static bool fault_run_plan(void *context, unsigned tick, struct sim_field *field, struct lane_faults *faults)
{
    const struct run *run = context;
    const struct fault_case *row = run->row;
    const unsigned end = FAULT_FIRST_TICK + (row->ticks > 0 ? row->ticks : 1u);
    const unsigned most = row->for_ever ? end + FAULT_GOOD_RUN : LONGEST;
    *field = fault_run_field_of(row, tick);
    if (tick >= FAULT_FIRST_TICK && tick < end)
        *faults = row->faults;
    if (row->then && tick >= end)
        row->then(tick - end + 1u, faults);
    if (tick > FAULT_FIRST_TICK) /* what disturbs does so once */
        faults->disturbance = tick == end ? row->end : SIM_NODE_NOTHING;
    return tick < most && (tick < end + FAULT_GOOD_RUN || run->good < FAULT_GOOD_RUN);
}

/* The transfer of the first broken tick brings the record of the tick before. */
static void fault_run_judged(void *context, unsigned tick, const struct lane_verdict *v)
{
    struct run *run = context;
    run->good = v->good ? run->good + 1u : 0u;
    run->out->altered += v->altered && tick > 0;
    if (tick < FAULT_FIRST_TICK)
        return;
    run->letters[tick - FAULT_FIRST_TICK] = fault_run_letter(v);
    if (!v->good)
        run->last = tick - FAULT_FIRST_TICK + 1u;
}

struct fault_outcome fault_run(const struct fault_case *row, const struct sim_node_parameters *parts)
{
    struct fault_outcome out = {.detected_after = -1};
    struct run run = {.row = row, .out = &out};
    struct sim_node_parameters own = *parts;
    struct lane_bench bench;
    if (row->part)
        row->part(&own);
    sim_node *node = sim_node_new_as(&own);
    sim_node_power_on(node);
    lane_bench_start(&bench, node, lane_timing_of(16, 180, WHISKER_LIMIT_TICK_PERIOD));
    lane_bench_run(&bench, &(struct lane_world){&run, fault_run_plan, fault_run_judged});
    fault_run_summarise(&out, run.letters, run.last);
    run.letters[run.last] = '\0'; /* not shortened as the verdicts are */
    out.as_expected = fault_run_matches(row->expected, run.letters);
    fault_run_compare_counters(&out, row, node, run.letters);
    out.violations = sim_node_violations(node);
    sim_node_free(node);
    return out;
}

static const struct {
    char letter;
    uint8_t counter;
    bool once; /* counted at the reset, reported in every tick until the sensor is awake */
} COUNTERS[] = {
    {'C', WHISKER_HEALTH_ORDER_CRC, false},     {'M', WHISKER_HEALTH_ORDER_MISSING, false},
    {'V', WHISKER_HEALTH_SERVICE_CRC, false},   {'F', WHISKER_HEALTH_LINK_OVERFLOW, false},
    {'e', WHISKER_HEALTH_SENSOR_ERROR, false},  {'S', WHISKER_HEALTH_STARTING, false},
    {'R', WHISKER_HEALTH_RESYNC, false},        {'L', WHISKER_HEALTH_LATE, false},
    {'x', WHISKER_HEALTH_SENSOR_SUM, false},    {'0', WHISKER_HEALTH_SENSOR_START, false},
    {'a', WHISKER_HEALTH_SENSOR_ABSENT, false}, {'j', WHISKER_HEALTH_STEP, false},
    {'O', WHISKER_HEALTH_OVERRUN, false},       {'P', WHISKER_HEALTH_RESET_POWER, true},
    {'W', WHISKER_HEALTH_RESET_WATCHDOG, true}, {'T', WHISKER_HEALTH_RESET_TRAP, true},
};
enum { COUNTER_COUNT = sizeof COUNTERS / sizeof *COUNTERS };

static void fault_run_count(char text[FAULT_TEXT], char letter, unsigned number)
{
    const size_t at = strlen(text);
    if (number > 0)
        snprintf(text + at, FAULT_TEXT - at, "%s%c=%u", at ? " " : "", letter, number);
}

void fault_counted(const sim_node *node, char text[FAULT_TEXT])
{
    text[0] = '\0';
    for (unsigned i = 0; i < COUNTER_COUNT; i++)
        fault_run_count(text, COUNTERS[i].letter, sim_node_counted(node, COUNTERS[i].counter));
}

void fault_reported(const char *letters, char text[FAULT_TEXT])
{
    text[0] = '\0';
    for (unsigned i = 0; i < COUNTER_COUNT; i++) {
        unsigned number = 0;
        for (const char *c = letters; *c; c++)
            number += *c == COUNTERS[i].letter;
        fault_run_count(text, COUNTERS[i].letter, COUNTERS[i].once && number > 0 ? 1u : number);
    }
}
