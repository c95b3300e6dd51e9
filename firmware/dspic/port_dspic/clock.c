/* From the internal oscillator at 3.7 MIPS to 38.69 MIPS through the PLL. */
#include <stdbool.h>

#include "port.h"
#include "sfr.h"

/* FCY = FRC * M / (N1 * N2) / 2 with N1 = N2 = 2. M 43 would exceed 40 MIPS on an oscillator 2 % fast; M 42 stays
 * at 39.5. */
#define PLL_M 42u
#define PLL_N1 2u
#define PLL_N2 2u
#define FCY_FASTEST_HZ (FRC_HZ / 100u * 102u / PLL_N1 / PLL_N2 / 2u * PLL_M)

#if FCY_FASTEST_HZ > FCY_MAX_HZ
#error "a fast oscillator would exceed 40 MIPS"
#endif

#define PLL_FEEDBACK (PLL_M - 2u)
#define PLL_DIVISORS (PLL_N1 - 2u) /* PLLPOST 0: N2 = 2 */

static uint16_t clock_source(struct board *board)
{
    return sfr_read(board, OSCCON) >> OSCCON_COSC_SHIFT & 7u;
}

/* The loader has done it for the application. COSC and LOCK alone do not say so: a reset other than power-on may leave
 * them while the divisors go back to their reset values, which make 23 MHz. */
static bool clock_is_done(struct board *board)
{
    return clock_source(board) == OSC_FRC_PLL && sfr_read(board, OSCCON) & OSCCON_LOCK &&
           sfr_read(board, PLLFBD) == PLL_FEEDBACK && sfr_read(board, CLKDIV) == PLL_DIVISORS;
}

static void clock_switch_to(struct board *board, uint8_t oscillator)
{
    cpu_write_osccon_high(board, oscillator);
    cpu_write_osccon_low(board, OSCCON_OSWEN);
    while (sfr_read(board, OSCCON) & OSCCON_OSWEN || clock_source(board) != oscillator) {
        /* about a millisecond, once */
    }
}

void clock_start(struct board *board)
{
    sfr_set(board, RCON, RCON_SWDTEN); /* a PLL that never locks would hang the node for ever: it tries again */
    if (clock_is_done(board))
        return;
    if (clock_source(board) != OSC_FRC)
        clock_switch_to(board, OSC_FRC); /* the divisors must not change while the PLL runs the chip */
    sfr_write(board, PLLFBD, PLL_FEEDBACK);
    sfr_write(board, CLKDIV, PLL_DIVISORS);
    clock_switch_to(board, OSC_FRC_PLL);
    while (!(sfr_read(board, OSCCON) & OSCCON_LOCK)) {
        /* the switch waits for it */
    }
}
