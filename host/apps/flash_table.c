#include "flash_table.h"

#include <inttypes.h>
#include <stdio.h>

#include "whisker_protocol.h"

const char *flash_state_text(uint16_t state)
{
#define TEXT(name, value, text)                                                                                        \
    case value:                                                                                                        \
        return text;
    switch (state) {
        WHISKER_NODE_STATES(TEXT)
    default:
        return "a state this host does not know: install the newer of the two";
    }
#undef TEXT
}

const char *flash_health_name(uint8_t counter)
{
    static const char *const names[] = {
#define NAME(name, value, text) [value] = #name,
        WHISKER_HEALTH(NAME)
#undef NAME
    };
    return names[counter];
}

const char *flash_serial_text(uint32_t serial, char text[FLASH_SERIAL_BYTES])
{
    if (serial == WHISKER_LIMIT_SERIAL_NONE) {
        return "none";
    }
    snprintf(text, FLASH_SERIAL_BYTES, "%" PRIu32, serial);
    return text;
}

void flash_print_nodes(const struct whisker_node nodes[WHISKER_FRAME_LANES])
{
    printf("lane  serial      version  options  wire  chip    loader  state\n");
    for (int lane = 0; lane < WHISKER_FRAME_LANES; lane++) {
        const struct whisker_node *n = &nodes[lane];
        char serial[FLASH_SERIAL_BYTES], version[16];
        if (n->present) {
            snprintf(version, sizeof version, "%u.%u", n->firmware >> 8, n->firmware & 0xFFu);
            printf("%4d  %-10s  %-7s  0x%04x   %-4u  0x%04x  %-6u  %s\n", lane, flash_serial_text(n->serial, serial),
                   version, n->options, n->wire_version, n->chip, n->loader, flash_state_text(n->state));
        }
    }
}

static const char *flash_table_outcome(const struct whisker_update *update, const struct whisker_node *node,
                                       uint16_t version)
{
    if (update->silent) {
        return "stopped answering: check its supply and cable, then flash again";
    }
    if (update->stuck) {
        return "takes no more blocks: flash again; program it by wire if that does not help";
    }
    if (update->state == WHISKER_NODE_STATE_LOADER || update->state == WHISKER_NODE_STATE_APPLICATION) {
        return "restarted during the update: check its supply, then flash again";
    }
    if (!update->done) {
        return flash_state_text(update->state);
    }
    if (!node->present || node->state != WHISKER_NODE_STATE_APPLICATION) {
        return "loaded, but the application does not answer: flash again";
    }
    return node->firmware == version ? NULL : "runs another version than the image's: flash again";
}

int flash_print_result(const struct whisker_update updates[WHISKER_FRAME_LANES],
                       const struct whisker_node nodes[WHISKER_FRAME_LANES], uint16_t version)
{
    int failed = 0;
    for (int lane = 0; lane < WHISKER_FRAME_LANES; lane++) {
        if (updates[lane].wanted) {
            const char *trouble = flash_table_outcome(&updates[lane], &nodes[lane], version);
            printf("lane %2d: %s\n", lane, trouble ? trouble : "updated");
            failed += trouble != NULL;
        }
    }
    return failed;
}

uint32_t flash_lanes_of(const struct whisker_node nodes[WHISKER_FRAME_LANES], uint32_t serial)
{
    uint32_t lanes = 0;
    for (int lane = 0; lane < WHISKER_FRAME_LANES; lane++) {
        lanes |= (uint32_t)(nodes[lane].present && nodes[lane].serial == serial) << lane;
    }
    return lanes;
}

uint32_t flash_lanes(const struct whisker_node nodes[WHISKER_FRAME_LANES])
{
    uint32_t lanes = 0;
    for (int lane = 0; lane < WHISKER_FRAME_LANES; lane++) {
        lanes |= (uint32_t)nodes[lane].present << lane;
    }
    return lanes;
}

int flash_print_duplicates(const struct whisker_node nodes[WHISKER_FRAME_LANES])
{
    int concerned = 0;
    for (int lane = 0; lane < WHISKER_FRAME_LANES; lane++) {
        const uint32_t same = flash_lanes_of(nodes, nodes[lane].serial);
        if (!nodes[lane].present || nodes[lane].serial == WHISKER_LIMIT_SERIAL_NONE || same >> lane == 1 ||
            (same & ((UINT32_C(1) << lane) - 1)) != 0) {
            continue; /* alone, or reported already */
        }
        printf("serial number %" PRIu32 " is on several lanes:", nodes[lane].serial);
        for (int other = 0; other < WHISKER_FRAME_LANES; other++) {
            if (same >> other & 1) {
                printf(" %d", other);
                concerned++;
            }
        }
        printf("; give each its own: make flash TOOL=... SERIAL=n\n");
    }
    return concerned;
}
