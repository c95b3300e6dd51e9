/* What whisker-flash prints: the nodes there are, and what became of each. */
#ifndef WHISKER_FLASH_TABLE_H
#define WHISKER_FLASH_TABLE_H

#include "whisker/service.h"

#define FLASH_SERIAL_BYTES 16 /* room for a serial number as text */

/* What a person reads for a WHISKER_NODE_STATE_*, for a counter's number (WHISKER_HEALTH_*), for a serial number. */
const char *flash_state_text(uint16_t state);
const char *flash_health_name(uint8_t counter);
const char *flash_serial_text(uint32_t serial, char text[FLASH_SERIAL_BYTES]);

/* A line per node. */
void flash_print_nodes(const struct whisker_node nodes[WHISKER_FRAME_LANES]);

/* A line per lane that took part; `nodes`: as they were asked afterwards. Returns how many did not end with `version`.
 */
int flash_print_result(const struct whisker_update updates[WHISKER_FRAME_LANES],
                       const struct whisker_node nodes[WHISKER_FRAME_LANES], uint16_t version);

/* Names serial numbers that several nodes have, one line each. Returns the number of lanes concerned. */
int flash_print_duplicates(const struct whisker_node nodes[WHISKER_FRAME_LANES]);

/* Nodes with this serial number. */
uint32_t flash_lanes_of(const struct whisker_node nodes[WHISKER_FRAME_LANES], uint32_t serial);

/* Lanes with a node. */
uint32_t flash_lanes(const struct whisker_node nodes[WHISKER_FRAME_LANES]);

#endif
