/* Which peripheral sits on which pin; then the map is locked. */
#include "port.h"
#include "sfr.h"

#define BIT(pin) ((uint16_t)(1u << (pin)))
#define OUTPUT(pin, function) ((uint16_t)((function) << 8u * ((pin) % 2u)))
#define OUTPUT_REGISTER(pin) ((uint16_t)(RPOR0 + 2u * ((pin) / 2u)))
#define HIGH_FIELD(pin) ((uint16_t)((pin) << 8u))

void pins_start(struct board *board)
{
    const uint16_t open_drain = BIT(PIN_SENSOR_SELECT) | BIT(PIN_SENSOR_CLOCK) | BIT(PIN_SPARE);
    sfr_write(board, AD1PCFGL, 0xFFFFu); /* pins start as analogue inputs, which read 0 */
    sfr_set(board, LATB, BIT(PIN_SENSOR_SELECT));
    sfr_set(board, ODCB, open_drain); /* the sensor lives at 5 V */
    sfr_clear(board, TRISB, BIT(PIN_SENSOR_SELECT) | BIT(PIN_SENSOR_CLOCK) | BIT(PIN_LINK_MISO));
    sfr_write(board, RPINR0, HIGH_FIELD(PIN_SYNC));
    sfr_write(board, RPINR20, PIN_SENSOR_DATA | HIGH_FIELD(PIN_SENSOR_CLOCK));
    sfr_write(board, RPINR22, PIN_LINK_MOSI | HIGH_FIELD(PIN_LINK_CLOCK));
    sfr_write(board, RPINR23, PIN_LINK_SELECT);
    sfr_write(board, RPINR1, PIN_LINK_SELECT); /* the end of a transfer, by its rising edge */
    sfr_set(board, OUTPUT_REGISTER(PIN_SENSOR_CLOCK), OUTPUT(PIN_SENSOR_CLOCK, RP_SCK1));
    sfr_set(board, OUTPUT_REGISTER(PIN_LINK_MISO), OUTPUT(PIN_LINK_MISO, RP_SDO2));
    cpu_write_osccon_low(board, OSCCON_IOLOCK);
}
