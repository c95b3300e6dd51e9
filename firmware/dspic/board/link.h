/* Board contract: SPI slave in mode 1 towards the bridge, 16-bit words. */
#ifndef BOARD_LINK_H
#define BOARD_LINK_H

#include <stdint.h>

struct board; /* the port's own state */

/* Makes the slave ready for one transfer of LINK_WORDS from their start, whatever was clocked before: the first word is
 * preloaded, bit and word counts are zero. `words` stay unchanged until the next call.
 * When as many words were received, node_on_order() follows, once per call; more clocks are ignored. */
void board_link_arm(struct board *board, const uint16_t *words);

/* The same for the second window of a tick: it sends LINK_WORDS and receives SERVICE_WORDS; node_on_service() follows.
 */
void board_link_arm_service(struct board *board, const uint16_t *words);

#endif
