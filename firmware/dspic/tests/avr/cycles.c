/* Cycles of the core's event handlers on an ATmega1284P: a stand-in for the dsPIC, whose instructions do twice as much.
 * The board does nothing here, so this is the core alone. */
#include <avr/io.h>
#include <stdio.h>

#include "board/link.h"
#include "board/sensor.h"
#include "board/timer.h"
#include "machine.h"
#include "node.h"

void board_sensor_select(struct board *board, bool level)
{
    (void)board;
    (void)level;
}

void board_sensor_transfer(struct board *board, uint8_t byte)
{
    (void)board;
    (void)byte;
}

void board_timer_start(struct board *board, uint16_t us)
{
    (void)board;
    (void)us;
}

void board_watch_start(struct board *board)
{
    (void)board;
}

bool board_watch_exceeds(struct board *board, uint16_t us)
{
    (void)board;
    return us == 0;
}

void board_link_arm(struct board *board, const uint16_t *words)
{
    (void)board;
    (void)words;
}

void board_link_arm_service(struct board *board, const uint16_t *words)
{
    (void)board;
    (void)words;
}

static struct node node;
static const uint8_t FRAME[8] = {0xFF, 0x10, 0x80, 0x20, 0x70, 0x00, 0x00, 0x20};

/* Cycles of reading the counter twice, taken off. */
static uint16_t overhead;

static void begin(void)
{
    TCNT1 = 0;
}

static uint16_t end(void)
{
    return (uint16_t)(TCNT1 - overhead);
}

/* Stack used below this call: RAM between heap and stack is painted first. */
extern uint8_t __heap_start;
#define PAINT 0xA5u

static uint8_t *stack_now(void)
{
    return (uint8_t *)(uint16_t)SP;
}

static void paint(void)
{
    for (uint8_t *p = &__heap_start; p < stack_now() - 16; p++)
        *p = PAINT;
}

static uint16_t painted(void)
{
    uint16_t n = 0;
    for (const uint8_t *p = &__heap_start; *p == PAINT; p++)
        n++;
    return n;
}

/* What the bridge sends in every tick: whole, so that the node takes its number. */
static void make_order(uint16_t words[LINK_WORDS])
{
    uint8_t bytes[WHISKER_ORDER_BYTES] = {0};
    bytes[WHISKER_ORDER_TICK] = 1;
    bytes[WHISKER_ORDER_COMMAND] = WHISKER_COMMAND_SAMPLE;
    bytes[WHISKER_ORDER_CRC] = whisker_crc8(bytes, WHISKER_ORDER_CRC);
    for (uint8_t i = 0; i < LINK_WORDS; i++)
        words[i] = (uint16_t)((uint16_t)bytes[2u * i] << 8 | bytes[2u * i + 1u]);
}

static void one_tick(uint16_t cycles[5])
{
    uint16_t words[LINK_WORDS];
    make_order(words);
    begin();
    node_on_sync(&node);
    cycles[0] = end();
    begin();
    node_on_order(&node, words);
    cycles[1] = end();
    for (uint8_t i = 0; i < 8; i++) {
        begin();
        node_on_sensor_byte(&node, FRAME[i]);
        cycles[i == 7 ? 3 : 2] = end();
        if (i == 7)
            break;
        begin();
        node_on_timer(&node);
        cycles[4] = end();
    }
}

int main(void)
{
    uint16_t cycles[5];
    machine_start();
    TCCR1B = 1 << CS10;
    begin();
    overhead = end();
    node_start(&node, 0, WHISKER_CODE_STARTING);
    while (!node_ready(&node))
        node_on_timer(&node);
    paint();
    const uint16_t before = painted();
    one_tick(cycles);
    if (node.health[WHISKER_HEALTH_ORDER_CRC] != 0 || node.tick != 1u || node.reading.status != 0)
        printf("FAILED: not a tick of the usual kind\n");
    const uint16_t tick = (uint16_t)(cycles[0] + cycles[1] + 7u * cycles[2] + cycles[3] + 7u * cycles[4]);
    printf("cycles sync %u order %u byte %u last_byte %u gap %u tick %u\n", cycles[0], cycles[1], cycles[2], cycles[3],
           cycles[4], tick);
    printf("bytes node %u stack %u\n", (uint16_t)sizeof node, (uint16_t)(before - painted()));
    machine_stop();
    return 0;
}
