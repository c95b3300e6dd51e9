#include "daemon_nodes.h"

#include <inttypes.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "daemon_log.h"
#include "flash_table.h"
#include "whisker/errors.h"
#include "whisker/service.h"
#include "whisker_protocol.h"

#define COUNTS_BYTES 320 /* sixteen names and numbers */
#define LINE_BYTES 480

typedef uint16_t counts[WHISKER_HEALTH_COUNT][WHISKER_FRAME_LANES];

static int daemon_nodes_ask(struct whisker_device *device, uint32_t lanes,
                            struct whisker_node nodes[WHISKER_FRAME_LANES], counts c)
{
    int error = whisker_nodes_identify(device, lanes, nodes);
    for (uint8_t i = 0; !error && i < WHISKER_HEALTH_COUNT; i++) {
        error = whisker_nodes_health(device, flash_lanes(nodes), i, c[i]);
    }
    return error;
}

/* A line to the log and to the report; what finds no room in the report is in the log. */
__attribute__((format(printf, 3, 4))) static void
daemon_nodes_report(struct daemon_report *report, enum daemon_priority priority, const char *format, ...)
{
    char line[LINE_BYTES];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(line, sizeof line, format, arguments);
    va_end(arguments);
    daemon_log(priority, "%s", line);
    const size_t room = sizeof report->text - report->used;
    const int written = snprintf(report->text + report->used, room, "%s\n", line);
    report->used += written > 0 && (size_t)written < room ? (size_t)written : 0;
    report->text[report->used] = '\0';
}

static void daemon_nodes_log_node(int lane, const struct whisker_node *node, counts c, struct daemon_report *report)
{
    char serial[FLASH_SERIAL_BYTES], reported[COUNTS_BYTES] = "";
    size_t used = 0;
    for (uint8_t i = 0; i < WHISKER_HEALTH_COUNT; i++) {
        if (c[i][lane] > 0 && used < sizeof reported) {
            used +=
                (size_t)snprintf(reported + used, sizeof reported - used, ", %s %u", flash_health_name(i), c[i][lane]);
        }
    }
    daemon_nodes_report(report, LOG_NOTE, "lane %d: serial %s, version %u.%u, wire %u, %s%s", lane,
                        flash_serial_text(node->serial, serial), node->firmware >> 8, node->firmware & 0xFFu,
                        node->wire_version, flash_state_text(node->state), reported);
}

void daemon_nodes_log(struct whisker_device *device, uint32_t lanes, struct daemon_report *report)
{
    struct whisker_node nodes[WHISKER_FRAME_LANES];
    counts c;
    memset(c, 0, sizeof c);
    const int error = daemon_nodes_ask(device, lanes, nodes, c);
    if (error) {
        daemon_nodes_report(report, LOG_WARN, "nodes: %s; %s", whisker_error_text(error), whisker_error_remedy(error));
        return;
    }
    daemon_nodes_report(report, LOG_NOTE, "%d nodes answer", __builtin_popcount(flash_lanes(nodes)));
    for (int lane = 0; lane < WHISKER_FRAME_LANES; lane++) {
        if (nodes[lane].present) {
            daemon_nodes_log_node(lane, &nodes[lane], c, report);
        }
    }
}
