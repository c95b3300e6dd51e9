/* Board contract: the node's one-shot timer, and its watch. */
#ifndef BOARD_TIMER_H
#define BOARD_TIMER_H

#include <stdbool.h>
#include <stdint.h>

struct board; /* the port's own state */

/* node_on_timer() follows once, not sooner than `us` microseconds from now by the board's clock. A start before the end
 * replaces the earlier one, also if its event is already waiting to be delivered. */
void board_timer_start(struct board *board, uint16_t us);

/* Lets the watch run from zero. */
void board_watch_start(struct board *board);

/* True if more than `us` (1000 at most) microseconds by the board's clock have passed since, to 4 us; forgotten
 * now and then after 100 ms. */
bool board_watch_exceeds(struct board *board, uint16_t us);

#endif
