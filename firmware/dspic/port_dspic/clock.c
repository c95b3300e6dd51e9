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

/* The loader may have done it for the application: the PLL must not be changed while it runs the chip. */
static bool is_done(struct board *board)
{
    const uint16_t wanted = OSC_FRC_PLL << OSCCON_COSC_SHIFT | OSCCON_LOCK;
    return (sfr_read(board, OSCCON) & (7u << OSCCON_COSC_SHIFT | OSCCON_LOCK)) == wanted;
}

void clock_start(struct board *board)
{
    if (is_done(board))
        return;
    sfr_set(board, RCON, RCON_SWDTEN); /* a PLL that never locks would hang the node for ever: it tries again */
    sfr_write(board, PLLFBD, PLL_M - 2u);
    sfr_write(board, CLKDIV, PLL_N1 - 2u); /* PLLPOST 0: N2 = 2 */
    cpu_write_osccon_high(board, OSC_FRC_PLL);
    cpu_write_osccon_low(board, OSCCON_OSWEN);
    while ((sfr_read(board, OSCCON) >> OSCCON_COSC_SHIFT & 7u) != OSC_FRC_PLL ||
           !(sfr_read(board, OSCCON) & OSCCON_LOCK)) {
        /* about a millisecond, once */
    }
}
