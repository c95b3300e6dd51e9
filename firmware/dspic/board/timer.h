/* Board contract: the node's one-shot timer. */
#ifndef BOARD_TIMER_H
#define BOARD_TIMER_H

#include <stdint.h>

struct board; /* the port's own state */

/* node_on_timer() follows once, not sooner than `us` microseconds from now by the board's clock. A start before the end
 * replaces the earlier one, also if its event is already waiting to be delivered. */
void board_timer_start(struct board *board, uint16_t us);

#endif
