/* From the internal oscillator at 3.7 MIPS to 38.69 MIPS through the PLL. */
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

void clock_start(struct board *board)
{
    sfr_write(board, PLLFBD, PLL_M - 2u);
    sfr_write(board, CLKDIV, PLL_N1 - 2u); /* PLLPOST 0: N2 = 2 */
    cpu_write_osccon_high(board, OSC_FRC_PLL);
    cpu_write_osccon_low(board, OSCCON_OSWEN);
    while ((sfr_read(board, OSCCON) >> OSCCON_COSC_SHIFT & 7u) != OSC_FRC_PLL ||
           !(sfr_read(board, OSCCON) & OSCCON_LOCK)) {
        /* about a millisecond, once; a PLL that never locks is the watchdog's business */
    }
}
