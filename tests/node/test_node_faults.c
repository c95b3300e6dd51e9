/* The fault matrix: each fault is seen in-band within a tick, reported as what it is, counted once, costs no more than
 * its cause allows, and no good sample is altered. With an argument: writes the table there, as JSON. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <stdio.h>

#include "fault_matrix.h"

enum { DETECTED_WITHIN = 2 }; /* the broken tick's own record, or that of the tick after */

static bool is_right(const struct fault_case *row, const struct fault_outcome *o)
{
    return o->as_expected && o->counted_as_expected && o->lost <= row->most && o->detected_after <= DETECTED_WITHIN &&
           (o->altered == 0) == !row->undetectable && (o->violations == 0) == !row->breaches;
}

static void each_fault_is_reported_and_costs_what_its_cause_allows(void **state)
{
    unsigned wrong = 0;
    (void)state;
    for (unsigned i = 0; i < FAULT_CASE_COUNT; i++) {
        for (unsigned n = 0; n < FAULT_PARTS; n++) {
            const struct sim_node_parameters parts = fault_parts(n);
            const struct fault_outcome o = fault_run(&FAULT_CASES[i], &parts);
            if (is_right(&FAULT_CASES[i], &o))
                continue;
            wrong++;
            print_error("%s, parts %u: '%s', counted '%s', %u lost, %u altered, %u breaches\n", FAULT_CASES[i].name, n,
                        o.verdicts, o.counted, o.lost, o.altered, o.violations);
        }
    }
    assert_int_equal(wrong, 0);
}

static void the_matrix_is_large_enough(void **state)
{
    (void)state;
    assert_true(FAULT_CASE_COUNT >= 30);
}

static void write_escaped(FILE *file, const char *text)
{
    for (; *text; text++)
        fprintf(file, "%s%c", *text == '\\' ? "\\" : "", *text);
}

static int write_table(const char *path)
{
    FILE *file = fopen(path, "w");
    if (!file)
        return 1;
    for (unsigned i = 0; i < FAULT_CASE_COUNT; i++) {
        const struct fault_case *row = &FAULT_CASES[i];
        fprintf(file, "%s{\"fault\": \"%s\", \"remark\": \"%s\", \"undetectable\": %s, \"most\": %u, \"expected\": \"",
                i ? ",\n " : "[", row->name, row->remark ? row->remark : "", row->undetectable ? "true" : "false",
                row->most);
        write_escaped(file, row->expected);
        fprintf(file, "\", \"runs\": [");
        for (unsigned n = 0; n < FAULT_PARTS; n++) {
            const struct sim_node_parameters parts = fault_parts(n);
            const struct fault_outcome o = fault_run(row, &parts);
            fprintf(file,
                    "%s{\"verdicts\": \"%s\", \"lost\": %u, \"detected\": %d, \"counted\": \"%s\", \"altered\": %u}",
                    n ? ", " : "", o.verdicts, o.lost, o.detected_after, o.counted, o.altered);
        }
        fprintf(file, "]}");
    }
    fprintf(file, "]\n");
    return fclose(file) == 0 ? 0 : 1;
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(each_fault_is_reported_and_costs_what_its_cause_allows),
        cmocka_unit_test(the_matrix_is_large_enough),
    };
    return argc > 1 ? write_table(argv[1]) : cmocka_run_group_tests(tests, NULL, NULL);
}
