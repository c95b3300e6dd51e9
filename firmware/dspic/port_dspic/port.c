#include "port.h"

#include <stdbool.h>

#include "board/flash.h"
#include "boot/image.h"
#include "sfr.h"

#define PRIORITY 4u
#define TRAPPED 0x7EA9u /* unlikely in RAM that has lost its contents */

static const uint8_t SERVED[] = {IRQ_INT1, IRQ_T2, IRQ_SPI1, IRQ_SPI1_ERROR, IRQ_SPI2_ERROR, IRQ_DMA1, IRQ_INT2};

static void port_enable(struct board *board, uint16_t irq)
{
    const uint16_t shift = (uint16_t)(4u * (irq % 4u)), address = (uint16_t)(IPC0 + 2u * (irq / 4u));
    sfr_clear(board, address, (uint16_t)(7u << shift));
    sfr_set(board, address, (uint16_t)(PRIORITY << shift));
    sfr_clear(board, IRQ_WORD(IFS0, irq), IRQ_BIT(irq));
    sfr_set(board, IRQ_WORD(IEC0, irq), IRQ_BIT(irq));
}

/* Why the chip was reset, and forgets it. A plain power-up is none of the node's troubles. */
static uint8_t port_reset_code(struct board *board)
{
    const uint16_t cause = sfr_read(board, RCON);
    const bool trapped = board->trapped == TRAPPED, asked = board->asked == BOARD_ASKED_APPLICATION;
    board->trapped = 0;
    board->asked = 0;
    sfr_clear(board, RCON, RCON_POR | RCON_BOR | RCON_WDTO | RCON_SWR | RCON_EXTR | RCON_TRAPR | RCON_IOPUWR);
    if (cause & RCON_POR || asked)
        return WHISKER_CODE_STARTING;
    if (trapped || cause & (RCON_TRAPR | RCON_IOPUWR))
        return WHISKER_CODE_RESET_TRAP;
    return cause & RCON_WDTO ? WHISKER_CODE_RESET_WATCHDOG : WHISKER_CODE_RESET_POWER;
}

/* What a reset's cause cannot say: the application has neither failed nor been left. */
static bool port_loader_is_asked_for(struct board *board)
{
    return board->asked == BOARD_ASKED_LOADER && !(sfr_read(board, RCON) & RCON_POR);
}

void port_boot(struct board *board)
{
    clock_start(board);
    if (port_loader_is_asked_for(board) || !image_is_valid(board, board->loader.row))
        port_start_loader(board);
    else
#ifdef NODE_LOADER
        port_jump_to_application(board);
#else
        port_start(board);
#endif
}

static void port_start_peripherals(struct board *board)
{
    clock_start(board);
    pins_start(board);
    sensor_start(board);
    link_start(board);
}

static void port_serve_interrupts(struct board *board)
{
    for (uint16_t i = 0; i < sizeof SERVED; i++)
        port_enable(board, SERVED[i]);
    sfr_set(board, RCON, RCON_SWDTEN);
}

void port_start(struct board *board)
{
    board->loading = false;
    port_start_peripherals(board);
    node_start(&board->node, board, port_reset_code(board));
    port_serve_interrupts(board);
}

void port_start_loader(struct board *board)
{
    board->loading = true;
    port_start_peripherals(board);
    (void)port_reset_code(board);
    loader_start(&board->loader, board);
    node_start_loader(&board->node, board);
    port_serve_interrupts(board);
}

/* The application's answers: who it is, and the way to the loader. */
static void port_serve_application(struct board *board)
{
    struct service *service = &board->node.service;
    const uint8_t *order = service->bytes;
    const uint8_t item = order[WHISKER_SERVICE_ARGUMENT];
    uint16_t alpha = 0, beta = WHISKER_NODE_STATE_APPLICATION;
    if (order[WHISKER_SERVICE_COMMAND] == WHISKER_SERVICE_COMMAND_INFO)
        loader_info(board, item, WHISKER_NODE_STATE_APPLICATION, board->loader.row, &alpha, &beta);
    else if (order[WHISKER_SERVICE_COMMAND] == WHISKER_SERVICE_COMMAND_ENTER &&
             service_addresses(order, board_serial(board)))
        board_enter_loader(board);
    service_answer(service, alpha, beta);
}

static void port_serve(struct board *board)
{
    if (node_tell_health(&board->node))
        return;
    if (board->loading)
        loader_serve(&board->loader, &board->node.service);
    else
        port_serve_application(board);
}

void port_loop(struct board *board)
{
    cpu_clear_watchdog(board);
    if (board->node.service.waiting)
        port_serve(board);
    else
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
