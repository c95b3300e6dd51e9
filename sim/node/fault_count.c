/* The node's own counters beside what its records reported. */
#include <stdio.h>
#include <string.h>

#include "fault_matrix.h"
#include "whisker_protocol.h"

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

static void fault_count_append(char text[FAULT_TEXT], char letter, unsigned number)
{
    const size_t at = strlen(text);
    if (number > 0)
        snprintf(text + at, FAULT_TEXT - at, "%s%c=%u", at ? " " : "", letter, number);
}

void fault_counted(const sim_node *node, char text[FAULT_TEXT])
{
    text[0] = '\0';
    for (unsigned i = 0; i < COUNTER_COUNT; i++)
        fault_count_append(text, COUNTERS[i].letter, sim_node_counted(node, COUNTERS[i].counter));
}

void fault_told(const char *letters, char text[FAULT_TEXT])
{
    text[0] = '\0';
    for (unsigned i = 0; i < COUNTER_COUNT; i++) {
        unsigned number = 0;
        for (const char *c = letters; *c; c++)
            number += *c == COUNTERS[i].letter;
        fault_count_append(text, COUNTERS[i].letter, COUNTERS[i].once && number > 0 ? 1u : number);
    }
}
