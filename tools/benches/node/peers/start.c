/* The start of a peer's program, on the firmware's own board, and what it is given. */
#include "board.h"
#include "peer.h"
#include "rp2040.h"

#define SAMPLES (WATCHDOG_SCRATCH0 + 4u) /* scratch registers, which the bench reads */
#define LATEST (WATCHDOG_SCRATCH0 + 8u)
#define VECTORS 48u

extern uint32_t stack_top[], bss_start[], bss_end[];

void peer_wait_ms(uint32_t ms)
{
    const uint32_t began = board_now();
    board_lamp(true);
    while (board_now() - began < 1000u * ms)
        board_alive();
    board_lamp(false);
}

void peer_transfer(const uint8_t *out, uint8_t *in, uint32_t n, int in_mode_3)
{
    uint16_t words[BOARD_TRANSFER_MAX] = {0};
    for (uint32_t i = 0; i < n; i++)
        words[i / 2u] |= (uint16_t)(out[i] << (i % 2u ? 0u : 8u));
    board_ask(0, words, (n + 1u) / 2u, in_mode_3);
    for (uint32_t i = 0; i < n; i++)
        in[i] = (uint8_t)(words[i / 2u] >> (i % 2u ? 0u : 8u));
}

void peer_took(int32_t value)
{
    board_alive();
    REG(LATEST) = (uint32_t)value;
    REG(SAMPLES)++;
}

static void peer_start(void)
{
    for (uint32_t *at = bss_start; at < bss_end; at++)
        *at = 0;
    (void)board_init();
    REG(SAMPLES) = 0;
    board_alive();
    peer_main();
    board_fault();
}

__attribute__((section(".vectors"), used)) static void *const vectors[VECTORS] = {
    stack_top, (void *)peer_start, (void *)board_fault, (void *)board_fault};
