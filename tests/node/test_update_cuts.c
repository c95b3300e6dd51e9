/* The supply fails at each step of an update, and at any time: the node reports it, what then runs is whole, and the
 * next update succeeds. WHISKER_CUTS=n: cuts at random times, 150 by default. With an argument: writes the table of the
 * steps there, as JSON; a second one is how many nodes of each. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

#include "sim_rng.h"
#include "update_cuts.h"

enum { SEEDS = 3, HEADER_CUTS = 128, WORD_NS = 40000 };

static bool is_right(const struct update_cut_outcome *o, unsigned fates)
{
    return o->reported && (o->fate & fates) != 0 && o->ticks <= UPDATE_CUT_TICKS && o->again;
}

static void print_wrong(const char *name, const struct update_cut_outcome *o)
{
    print_error("%s: fate %d, %s, %u ticks, second update %s\n", name, (int)o->fate,
                o->reported ? "reported" : "not reported", o->ticks, o->again ? "good" : "failed");
}

static void power_may_fail_at_each_step(void **state)
{
    unsigned wrong = 0;
    (void)state;
    for (unsigned i = 0; i < UPDATE_CUT_CASE_COUNT; i++) {
        const struct update_cut_case *row = &UPDATE_CUT_CASES[i];
        for (unsigned seed = 0; seed < SEEDS; seed++) {
            const struct update_cut_outcome o = update_cut_run(row->cut, 0, seed);
            if (is_right(&o, row->fates))
                continue;
            wrong++;
            print_wrong(row->name, &o);
        }
    }
    assert_int_equal(wrong, 0);
}

static uint64_t length_of_an_update_ns(void)
{
    struct update_bench b;
    const struct update_image image = update_image_of(UPDATE_VERSION);
    assert_true(update_begin(&b, 1, 1, WHISKER_LIMIT_CHIP_ID));
    update_run(&b, &image, 0);
    sim_node_free(b.node);
    return b.ticks * SIM_TICK_NS;
}

static void cut_at(uint64_t after_ns, uint64_t seed, unsigned seen[FATE_NEW + 1])
{
    const struct update_cut_outcome o = update_cut_run((struct update_cut){0}, after_ns, seed);
    if (!is_right(&o, FATE_OLD | FATE_LOADER | FATE_NEW))
        print_wrong("at any time", &o);
    assert_true(is_right(&o, FATE_OLD | FATE_LOADER | FATE_NEW));
    seen[o.fate]++;
}

static void power_may_fail_at_any_time(void **state)
{
    const char *asked = getenv("WHISKER_CUTS");
    const unsigned cuts = asked ? (unsigned)strtoul(asked, NULL, 10) : 150u;
    const uint64_t length_ns = length_of_an_update_ns() + 4u * SIM_TICK_NS;
    unsigned seen[FATE_NEW + 1] = {0};
    (void)state;
    for (unsigned i = 0; i < cuts; i++) {
        uint64_t draw = i;
        cut_at(sim_rng_mix(&draw) % length_ns, i, seen);
    }
    print_message("%u cuts: %u times the loader waits, %u the old image runs, %u the new one\n", cuts,
                  seen[FATE_LOADER], seen[FATE_OLD], seen[FATE_NEW]);
    assert_true(seen[FATE_LOADER] > 0 && seen[FATE_OLD] > 0 && seen[FATE_NEW] > 0);
}

/* The header's row is the last that is written: cuts a word's time apart around the end. */
static void power_may_fail_at_each_word_of_the_header(void **state)
{
    const uint64_t end_ns = length_of_an_update_ns();
    unsigned seen[FATE_NEW + 1] = {0};
    (void)state;
    for (uint64_t before = 0; before < HEADER_CUTS; before++)
        cut_at(end_ns - before * WORD_NS, 1, seen);
    assert_true(seen[FATE_LOADER] > 0 && seen[FATE_NEW] > 0);
    assert_int_equal(seen[FATE_OLD], 0);
}

static int write_table(const char *path, unsigned seeds)
{
    FILE *file = fopen(path, "w");
    if (!file)
        return 1;
    for (unsigned i = 0; i < UPDATE_CUT_CASE_COUNT; i++) {
        const struct update_cut_case *row = &UPDATE_CUT_CASES[i];
        fprintf(file, "%s{\"step\": \"%s\", \"allowed\": %u, \"remark\": \"%s\", \"runs\": [", i ? ",\n " : "[",
                row->name, row->fates, row->remark ? row->remark : "");
        for (unsigned seed = 0; seed < seeds; seed++) {
            const struct update_cut_outcome o = update_cut_run(row->cut, 0, seed);
            fprintf(file, "%s{\"fate\": %d, \"reported\": %s, \"ticks\": %u, \"again\": %s}", seed ? ", " : "",
                    (int)o.fate, o.reported ? "true" : "false", o.ticks, o.again ? "true" : "false");
        }
        fprintf(file, "]}");
    }
    fprintf(file, "]\n");
    return fclose(file) == 0 ? 0 : 1;
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(power_may_fail_at_each_step),
        cmocka_unit_test(power_may_fail_at_each_word_of_the_header),
        cmocka_unit_test(power_may_fail_at_any_time),
    };
    if (argc > 1)
        return write_table(argv[1], argc > 2 ? (unsigned)strtoul(argv[2], NULL, 10) : SEEDS);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
