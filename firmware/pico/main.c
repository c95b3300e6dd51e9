/* Vectors, the start behind boot stage 2, and the loop that shows by the lamp how things are. */
#include "board.h"
#include "lanes.h"
#include "rp2040.h"
#include "stream.h"
#include "usb.h"
#include "whisker_protocol.h"

extern uint32_t stack_top[], bss_start[], bss_end[];

#define VECTORS 48u
#define EXCEPTION_IRQ 16u
#define PRIORITY_USB 1u /* the tick's is 0 */
#define PRIORITY_READING 2u
#define LEAVE_US 20000u /* until the host has the confirmation of its order for the boot drive */

static uint8_t main_code_of(enum board_start start)
{
    return start == BOARD_START_PIN        ? WHISKER_CODE_RESET_POWER
           : start == BOARD_START_WATCHDOG ? WHISKER_CODE_RESET_WATCHDOG
           : start == BOARD_START_FAULT    ? WHISKER_CODE_RESET_TRAP
                                           : WHISKER_CODE_STARTING;
}

static void main_priority(uint32_t irq, uint32_t priority)
{
    REG(NVIC_PRIORITY(irq)) = (REG(NVIC_PRIORITY(irq)) & ~(0xFFu << 8u * (irq % 4u))) | priority
                                                                                            << (8u * (irq % 4u) + 6u);
}

/* On: a host uses the board. A blink a second: none does. Four a second: a run in which a lane has no sensor. */
static void main_lamp(void)
{
    const uint32_t now = board_now();
    board_lamp(usb_is_in_use() ? !stream_runs() || lanes_ready() || (now >> 17 & 1u) != 0 : (now >> 19 & 1u) != 0);
}

static void main_leave(void)
{
    const uint32_t began = board_now();
    while (board_now() - began < LEAVE_US) {
    }
    board_boot_drive();
}

static void main_start(void)
{
    for (uint32_t *at = bss_start; at < bss_end; at++)
        *at = 0;
    const uint64_t number = board_number();
    lanes_start(main_code_of(board_init()));
    main_priority(IRQ_USB, PRIORITY_USB);
    main_priority(IRQ_TIMER0, PRIORITY_READING);
    usb_start(number);
    REG(NVIC_ENABLE) = 1u << IRQ_USB | 1u << IRQ_TIMER0;
    stream_start(usb_stream);
    for (;;) {
        __asm volatile("wfi");
        main_lamp();
        if (usb_wants_boot_drive())
            main_leave();
    }
}

__attribute__((section(".vectors"), used)) static void *const vectors[VECTORS] = {
    stack_top,
    (void *)main_start,
    (void *)board_fault,
    (void *)board_fault,
    [11] = (void *)board_fault,
    [14] = (void *)board_fault,
    [15] = (void *)stream_tick,
    [EXCEPTION_IRQ + IRQ_TIMER0] = (void *)stream_read,
    [EXCEPTION_IRQ + IRQ_USB] = (void *)usb_on_interrupt,
};
