/* Cycles of what the main loop does with a service order on an ATmega1284P, a stand-in for the dsPIC; flash is memory.
 */
#include <avr/io.h>
#include <stdio.h>

#include "boot/loader.h"
#include "flash_board.h"
#include "machine.h"
#include "orders.h"

static struct loader loader;
static struct service service;
static uint8_t row[WHISKER_LIMIT_FLASH_ROW_BYTES];
static uint16_t overhead;

static void begin(void)
{
    TCNT1 = 0;
}

static uint16_t end(void)
{
    return (uint16_t)(TCNT1 - overhead);
}

static void load(uint8_t command, uint32_t argument, uint16_t words[SERVICE_WORDS])
{
    uint8_t bytes[WHISKER_SERVICE_BYTES];
    order_of(bytes, 1, command, argument, NULL);
    words_of(bytes, words);
}

int main(void)
{
    uint16_t words[SERVICE_WORDS];
    machine_start();
    TCCR1B = 1 << CS10;
    begin();
    overhead = end();
    flash_board_reset();
    service_start(&service);
    loader_start(&loader, &flash_board);
    load(WHISKER_SERVICE_COMMAND_INFO, WHISKER_INFO_WIRE, words);
    begin();
    service_take(&service, words);
    const uint16_t take = end();
    begin();
    (void)service_next(&service);
    const uint16_t check = end();
    begin();
    service_answer(&service, 1, 2);
    const uint16_t answer = end();
    begin();
    (void)crc32_of(WHISKER_CRC32_INIT, row, sizeof row);
    const uint16_t crc = end();
    printf("service take %u check %u answer %u row_crc %u\n", take, check, answer, crc);
    printf("sizes service %u loader %u\n", (uint16_t)sizeof service, (uint16_t)sizeof loader);
    machine_stop();
    return 0;
}
