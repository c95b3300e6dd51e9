#include "port.h"

#include <stdbool.h>

#include "sfr.h"

#define PRIORITY 4u
#define TRAPPED 0x7EA9u /* unlikely in RAM that has lost its contents */

static const uint8_t SERVED[] = {IRQ_INT1, IRQ_T2, IRQ_SPI1, IRQ_SPI1_ERROR, IRQ_SPI2_ERROR, IRQ_DMA1, IRQ_INT2};

static void enable(struct board *board, uint16_t irq)
{
    const uint16_t shift = (uint16_t)(4u * (irq % 4u)), address = (uint16_t)(IPC0 + 2u * (irq / 4u));
    sfr_clear(board, address, (uint16_t)(7u << shift));
    sfr_set(board, address, (uint16_t)(PRIORITY << shift));
    sfr_clear(board, IRQ_WORD(IFS0, irq), IRQ_BIT(irq));
    sfr_set(board, IRQ_WORD(IEC0, irq), IRQ_BIT(irq));
}

/* Why the chip was reset, and forgets it. A plain power-up is none of the node's troubles. */
static uint8_t reset_code(struct board *board)
{
    const uint16_t cause = sfr_read(board, RCON);
    const bool trapped = board->trapped == TRAPPED;
    board->trapped = 0;
    sfr_clear(board, RCON, RCON_POR | RCON_BOR | RCON_WDTO | RCON_SWR | RCON_EXTR | RCON_TRAPR | RCON_IOPUWR);
    if (cause & RCON_POR)
        return WHISKER_CODE_STARTING;
    if (trapped || cause & (RCON_TRAPR | RCON_IOPUWR))
        return WHISKER_CODE_RESET_TRAP;
    return cause & RCON_WDTO ? WHISKER_CODE_RESET_WATCHDOG : WHISKER_CODE_RESET_POWER;
}

void port_start(struct board *board)
{
    clock_start(board);
    pins_start(board);
    sensor_start(board);
    link_start(board);
    node_start(&board->node, board, reset_code(board));
    for (uint16_t i = 0; i < sizeof SERVED; i++)
        enable(board, SERVED[i]);
    sfr_set(board, RCON, RCON_SWDTEN);
}

void port_loop(struct board *board)
{
    cpu_clear_watchdog(board);
    cpu_idle(board);
}

/* Nothing can be trusted after a trap: start anew, and say so. */
void port_on_trap(struct board *board)
{
    board->trapped = TRAPPED;
    cpu_reset(board);
}

void port_on_int1(struct board *board)
{
    sfr_clear(board, IRQ_WORD(IFS0, IRQ_INT1), IRQ_BIT(IRQ_INT1));
    node_on_sync(&board->node);
}

void port_on_t2(struct board *board)
{
    sfr_write(board, T2CON, 0); /* it runs once */
    sfr_clear(board, IRQ_WORD(IFS0, IRQ_T2), IRQ_BIT(IRQ_T2));
    node_on_timer(&board->node);
}

void port_on_spi1(struct board *board)
{
    sfr_clear(board, IRQ_WORD(IFS0, IRQ_SPI1), IRQ_BIT(IRQ_SPI1));
    node_on_sensor_byte(&board->node, (uint8_t)sfr_read(board, SPI1BUF));
}
