/* What a daemon logs of its nodes. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>
#include <stdio.h>
#include <string.h>

#include "daemon_log.h"
#include "daemon_nodes.h"
#include "fake_nodes.h"
#include "whisker/errors.h"
#include "whisker_protocol.h"

#define LANES 7u

static char lines[8][512]; /* as long as the log's */
static unsigned logged;
static struct daemon_report report;

void daemon_log(enum daemon_priority priority, const char *format, ...)
{
    va_list arguments;
    (void)priority;
    va_start(arguments, format);
    vsnprintf(lines[logged++ % 8u], sizeof lines[0], format, arguments);
    va_end(arguments);
}

void daemon_log_error(enum daemon_priority priority, const char *subject, int error)
{
    daemon_log(priority, "%s: error %d", subject, error);
}

static int begin(void **state)
{
    (void)state;
    fake_nodes_reset(2);
    logged = 0;
    report.used = 0;
    return 0;
}

static void each_node_gets_a_line_with_what_it_counted(void **state)
{
    (void)state;
    fakes.node[1].serial = WHISKER_LIMIT_SERIAL_NONE;
    fakes.node[1].health[WHISKER_HEALTH_OVERRUN] = 3;
    fakes.node[1].health[WHISKER_HEALTH_SENSOR_SUM] = 65535;
    fakes.node[1].state = WHISKER_NODE_STATE_LOADER;
    daemon_nodes_log(NULL, LANES, &report);
    assert_int_equal(logged, 3);
    assert_string_equal(lines[0], "2 nodes answer");
    assert_string_equal(lines[1], "lane 0: serial 1, version 1.0, wire 2, the application runs");
    assert_string_equal(lines[2],
                        "lane 1: serial none, version 1.0, wire 2, the loader waits, SENSOR_SUM 65535, OVERRUN 3");
    assert_string_equal(report.text,
                        "2 nodes answer\n"
                        "lane 0: serial 1, version 1.0, wire 2, the application runs\n"
                        "lane 1: serial none, version 1.0, wire 2, the loader waits, SENSOR_SUM 65535, OVERRUN 3\n");
}

/* Every counter at its largest still fits a line. */
static void sixteen_counters_fit(void **state)
{
    (void)state;
    for (unsigned i = 0; i < WHISKER_HEALTH_COUNT; i++) {
        fakes.node[0].health[i] = 65535;
    }
    daemon_nodes_log(NULL, 1, &report);
    assert_non_null(strstr(lines[1], "ORDER_CRC 65535"));
    assert_non_null(strstr(lines[1], "OVERRUN 65535")); /* the last */
}

/* Whole lines only, and never beyond the end. */
static void a_report_that_is_full_keeps_its_whole_lines(void **state)
{
    (void)state;
    report.used = sizeof report.text - 20;
    memset(report.text, '-', report.used);
    daemon_nodes_log(NULL, LANES, &report);
    assert_string_equal(report.text + sizeof report.text - 20, "2 nodes answer\n");
}

static void no_node_is_reported_too(void **state)
{
    (void)state;
    fake_nodes_reset(0);
    daemon_nodes_log(NULL, LANES, &report);
    assert_int_equal(logged, 1);
    assert_string_equal(lines[0], "0 nodes answer");
}

static void a_bridge_that_refuses_is_reported_in_one_line(void **state)
{
    (void)state;
    fakes.fail_after = 0;
    fakes.send_error = WHISKER_ERROR_DEVICE_REFUSED;
    daemon_nodes_log(NULL, LANES, &report);
    assert_int_equal(logged, 1);
    assert_non_null(strstr(lines[0], "nodes: the bridge refused the settings; "));
}

#define TEST(name) cmocka_unit_test_setup(name, begin)

int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(each_node_gets_a_line_with_what_it_counted),    TEST(sixteen_counters_fit),
        TEST(a_report_that_is_full_keeps_its_whole_lines),   TEST(no_node_is_reported_too),
        TEST(a_bridge_that_refuses_is_reported_in_one_line),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
