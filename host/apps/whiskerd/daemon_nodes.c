#include "daemon_nodes.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#include "daemon_log.h"
#include "flash_table.h"
#include "whisker/errors.h"
#include "whisker/service.h"
#include "whisker_protocol.h"

#define COUNTS_BYTES 320 /* sixteen names and numbers */

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

static void daemon_nodes_log_node(int lane, const struct whisker_node *node, counts c)
{
    char serial[FLASH_SERIAL_BYTES], reported[COUNTS_BYTES] = "";
    size_t used = 0;
    for (uint8_t i = 0; i < WHISKER_HEALTH_COUNT; i++) {
        if (c[i][lane] > 0 && used < sizeof reported) {
            used +=
                (size_t)snprintf(reported + used, sizeof reported - used, ", %s %u", flash_health_name(i), c[i][lane]);
        }
    }
    daemon_log(LOG_NOTE, "lane %d: serial %s, version %u.%u, wire %u, %s%s", lane,
               flash_serial_text(node->serial, serial), node->firmware >> 8, node->firmware & 0xFFu, node->wire_version,
               flash_state_text(node->state), reported);
}

void daemon_nodes_log(struct whisker_device *device, uint32_t lanes)
{
    struct whisker_node nodes[WHISKER_FRAME_LANES];
    counts c;
    memset(c, 0, sizeof c);
    const int error = daemon_nodes_ask(device, lanes, nodes, c);
    if (error) {
        daemon_log_error(LOG_WARN, "nodes", error);
        return;
    }
    daemon_log(LOG_NOTE, "%d nodes answer", __builtin_popcount(flash_lanes(nodes)));
    for (int lane = 0; lane < WHISKER_FRAME_LANES; lane++) {
        if (nodes[lane].present) {
            daemon_nodes_log_node(lane, &nodes[lane], c);
        }
    }
}
