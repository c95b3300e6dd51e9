/* SPI1 as the sensor's master, the timer that paces it, and the watch, T3, which always runs. */
#include "board/sensor.h"
#include "board/timer.h"

#include "port.h"
#include "sfr.h"

/* FCY / (16 * 7) = 345 kHz: a bit takes 2.9 us, 2.84 on an oscillator 2 % fast, and a sensor 10 % slow wants 2.53.
 * The sensor is only ever sent ones: the output stays off and the pull-up sends them. */
#define SENSOR_CON1 (SPICON1_MSTEN | SPICON1_DISSDO | 1u << SPICON1_PPRE_SHIFT | 1u << SPICON1_SPRE_SHIFT)

/* Counts of T2 per microsecond at FCY 38.69 MHz, rounded up: 4.836 at 1:8 and 0.6045 at 1:64. */
#define SHORT_MOST_US 8000u
#define SHORT_COUNTS(us) ((uint16_t)(((uint32_t)(us)*155u >> 5) + 1u))
#define LONG_COUNTS(us) ((uint16_t)(((uint32_t)(us)*155u >> 8) + 1u))
#define PRESCALE_8 (1u << TCON_TCKPS_SHIFT)
#define PRESCALE_64 (2u << TCON_TCKPS_SHIFT)

void sensor_start(struct board *board)
{
    sfr_write(board, SPI1STAT, 0);
    sfr_write(board, SPI1CON1, SENSOR_CON1);
    sfr_write(board, SPI1STAT, SPISTAT_SPIEN);
}

/* Cannot happen while each byte is read before the next is sent. If it does, a byte is lost and reception has stopped:
 * the module begins anew, and the frame is given up. */
void port_on_spi1_error(struct board *board)
{
    sensor_start(board);
    sfr_clear(board, IRQ_WORD(IFS0, IRQ_SPI1_ERROR), IRQ_BIT(IRQ_SPI1_ERROR));
    sfr_clear(board, IRQ_WORD(IFS0, IRQ_SPI1), IRQ_BIT(IRQ_SPI1)); /* what it would read is an older byte */
    node_on_sensor_overrun(&board->node);
}

void board_sensor_select(struct board *board, bool level)
{
    if (level)
        sfr_set(board, LATB, (uint16_t)(1u << PIN_SENSOR_SELECT));
    else
        sfr_clear(board, LATB, (uint16_t)(1u << PIN_SENSOR_SELECT));
}

void board_sensor_transfer(struct board *board, uint8_t byte)
{
    sfr_write(board, SPI1BUF, byte);
}

void board_timer_start(struct board *board, uint16_t us)
{
    const bool is_short = us <= SHORT_MOST_US;
    sfr_write(board, T2CON, 0);
    sfr_write(board, TMR2, 0);
    sfr_write(board, PR2, is_short ? SHORT_COUNTS(us) : LONG_COUNTS(us));
    sfr_clear(board, IRQ_WORD(IFS0, IRQ_T2), IRQ_BIT(IRQ_T2)); /* a pending interrupt flag is void */
    sfr_write(board, T2CON, TCON_TON | (is_short ? PRESCALE_8 : PRESCALE_64));
}

void board_watch_start(struct board *board)
{
    sfr_write(board, TMR3, 0);
    sfr_write(board, T3CON, TCON_TON | PRESCALE_64);
}

bool board_watch_exceeds(struct board *board, uint16_t us)
{
    return sfr_read(board, TMR3) > LONG_COUNTS(us);
}
