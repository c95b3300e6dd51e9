/* The chip's side of reset and interrupts; only its compiler sees this. Built twice: as the loader (-DNODE_LOADER),
 * which uses the alternate vector table, and as the application, which is reached through its jump table. */
#include "port.h"
#include "sfr.h"

#define APPLICATION_ENTRY 0x2080u /* (application_row + 1) rows of 128 address units: jump_table.s */

/* Both programs find `asked` and `trapped` at the same place: what one writes before a reset the other reads after it.
 */
static struct board board __attribute__((persistent, address(0x0800)));

/* The constants that an interrupt reads (a busy answer, tables) lie behind PSV: auto_psv sets its page, four cycles. */
#define VECTOR __attribute__((interrupt, auto_psv))

#ifdef NODE_LOADER
#define HANDLER(name) _Alt##name
#else
#define HANDLER(name) _##name
#endif

void VECTOR HANDLER(INT1Interrupt)(void)
{
    port_on_int1(&board);
}

void VECTOR HANDLER(T2Interrupt)(void)
{
    port_on_t2(&board);
}

void VECTOR HANDLER(SPI1Interrupt)(void)
{
    port_on_spi1(&board);
}

void VECTOR HANDLER(SPI1ErrInterrupt)(void)
{
    port_on_spi1_error(&board);
}

void VECTOR HANDLER(SPI2ErrInterrupt)(void)
{
    port_on_spi2_error(&board);
}

void VECTOR HANDLER(DMA1Interrupt)(void)
{
    port_on_dma1(&board);
}

void VECTOR HANDLER(INT2Interrupt)(void)
{
    port_on_int2(&board);
}

void VECTOR HANDLER(OscillatorFail)(void)
{
    port_on_trap(&board);
}

void VECTOR HANDLER(AddressError)(void)
{
    port_on_trap(&board);
}

void VECTOR HANDLER(StackError)(void)
{
    port_on_trap(&board);
}

void VECTOR HANDLER(MathError)(void)
{
    port_on_trap(&board);
}

void VECTOR HANDLER(DMACError)(void)
{
    port_on_trap(&board);
}

int main(void)
{
#ifdef NODE_LOADER
    sfr_set(&board, INTCON2, INTCON2_ALTIVT);
    port_boot(&board);
#else
    port_start(&board);
#endif
    for (;;)
        port_loop(&board);
}

#ifdef NODE_LOADER
/* The first entry of its jump table, behind the row of its header. */
void port_jump_to_application(struct board *from)
{
    sfr_clear(from, INTCON2, INTCON2_ALTIVT);
    ((void (*)(void))APPLICATION_ENTRY)();
}
#endif
