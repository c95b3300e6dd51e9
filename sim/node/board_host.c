#include "board_host.h"

#include <string.h>

#include "board/link.h"   // board_link_arm
#include "board/sensor.h" // board_sensor_select, board_sensor_transfer
#include "board/timer.h"  // board_timer_start

#define SCK_NS 2800u /* FCY/112 at 40 MHz: 357 kHz */
#define HALF (SCK_NS / 2u)
#define BYTE_NS (8u * SCK_NS - HALF) /* first rising edge to last falling edge: the SPI's interrupt */

#if BYTE_NS > BOARD_SENSOR_BYTE_MAX_US * 1000u
#error "a byte takes longer than the board's contract allows"
#endif

void board_reset(struct board *board, uint64_t now_ns)
{
    memset(board, 0, sizeof *board);
    board->now_ns = now_ns;
    board->timer_ns = BOARD_NEVER;
    board->byte_ns = BOARD_NEVER;
    link_slave_reset(&board->link);
}

uint64_t board_next_ns(const struct board *board)
{
    return board->timer_ns < board->byte_ns ? board->timer_ns : board->byte_ns;
}

void board_timer_start(struct board *board, uint16_t us)
{
    board->timer_ns = board->now_ns + us * UINT64_C(1000);
}

void board_link_arm(struct board *board, const uint16_t *words)
{
    /* the words armed before must have stayed as they were until now */
    board->misuses += board->link.words && memcmp(board->link.words, board->armed, sizeof board->armed) != 0;
    memcpy(board->armed, words, sizeof board->armed);
    link_slave_arm(&board->link, words);
}

void board_sensor_select(struct board *board, bool level)
{
    mlx90333_select(&board->sensor, board->now_ns, level);
}

void board_sensor_transfer(struct board *board, uint8_t byte)
{
    if (board->byte_ns != BOARD_NEVER) {
        board->misuses++;
        return;
    }
    board->sending = byte;
    board->byte_ns = board->now_ns + BYTE_NS;
}

uint8_t board_clock_byte(struct board *board)
{
    uint64_t edge_ns = board->byte_ns - BYTE_NS;
    uint8_t received = 0;
    for (uint8_t mask = 0x80u; mask != 0; mask >>= 1, edge_ns += SCK_NS) {
        const bool out = (board->sending & mask) != 0;
        mlx90333_clock(&board->sensor, edge_ns, true, out);
        const bool in = mlx90333_clock(&board->sensor, edge_ns + HALF, false, out);
        received = (uint8_t)(received << 1 | in);
    }
    board->byte_ns = BOARD_NEVER;
    return received;
}
