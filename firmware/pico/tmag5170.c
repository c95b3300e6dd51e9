#include "tmag5170.h"

#include <stddef.h>

#include "whisker_protocol.h" // WHISKER_CODE_*

#define DEVICE_CONFIG 0x0u
#define SENSOR_CONFIG 0x1u
#define SYSTEM_CONFIG 0x2u
#define X_RESULT 0x9u
#define TEST_CONFIG 0xFu
#define ACTIVE_TRIGGER 0x1030u /* DEVICE_CONFIG: a conversion when asked, of two samples an axis: 175 us */
#define ALL_AXES 0x01EAu       /* SENSOR_CONFIG: X, Y, Z, each of the range 100 mT, or 300 of version 2 */
#define TRIGGER_ALERT 0x0400u  /* SYSTEM_CONFIG: by the pin */
#define TYPE_XY (1u << 6)      /* . frames of two axes; 0: of registers */
#define TYPE_ZY (3u << 6)
#define READ 0x80000000u
#define STATUS_OF_PLAIN 4u /* its lowest bit in a frame of a register */
#define SETS_MASK 7u       /* of a frame's status: conversions, modulo 8 */
#define TRIES 8u           /* conversions compared before plain reads are taken */
#define AXES 3u

enum step { FIND, CONFIGURE, COMPARE };

/* Bits of a nibble's place: of the first channel's three, of the second's three, of the status. Whether the CRC's last
 * bit is inverted. Bits that are the same in both frames of a reading: Y, and the number of the conversion. */
struct layout {
    uint8_t shift[6], status, inverted;
    uint32_t same;
};
#define LAYOUT(a, b, c, d, e, f, status, inverted)                                                                     \
    {                                                                                                                  \
        {a, b, c, d, e, f}, status, inverted, 0xFu << d | 0xFu << e | 0xFu << f | SETS_MASK << status                  \
    }
static const struct layout LAYOUTS[] = {
    LAYOUT(16, 12, 4, 24, 20, 8, 28, 0),                                      /* the maker's code */
    LAYOUT(16, 12, 4, 24, 20, 8, 28, 1),                                      /* and a CRC as TI E2E 1199728 saw it */
    LAYOUT(24, 20, 16, 12, 8, 4, 28, 0), LAYOUT(24, 20, 16, 12, 8, 4, 28, 1), /* one axis behind the other */
    LAYOUT(20, 16, 8, 28, 24, 12, 4, 0), LAYOUT(20, 16, 8, 28, 24, 12, 4, 1), /* the data sheet of 2021: status last */
};
#define LAYOUT_COUNT (sizeof LAYOUTS / sizeof LAYOUTS[0])
#define LAYOUT_PLAIN LAYOUT_COUNT

/* x^4 + x + 1 from 0xF over the upper 28 bits; the register after each byte, and whole words to send. */
static uint8_t crc_after[256];
static uint32_t pairs[2], plains[AXES];
/* Answers that wait to be taken apart. */
static uint32_t held[BOARD_BUSES][AXES];
static uint8_t held_lanes[BOARD_BUSES] = {BOARD_LANE_NONE, BOARD_LANE_NONE};

static uint32_t tmag5170_crc(uint32_t word)
{
    uint32_t crc = crc_after[0xF0u ^ word >> 24];
    crc = crc_after[crc << 4 ^ (word >> 16 & 0xFFu)];
    crc = crc_after[crc << 4 ^ (word >> 8 & 0xFFu)];
    return crc_after[crc << 4 ^ (word & 0xF0u)];
}

static uint32_t tmag5170_whole(uint32_t word)
{
    return word | tmag5170_crc(word);
}

static uint32_t tmag5170_frame(uint8_t lane, uint32_t word)
{
    word = tmag5170_whole(word);
    uint16_t words[BOARD_TRANSFER_MAX] = {(uint16_t)(word >> 16), (uint16_t)word};
    board_ask(lane, words, 2, false);
    return (uint32_t)words[0] << 16 | words[1];
}

static uint32_t tmag5170_write(uint32_t number, uint32_t value)
{
    return number << 24 | value << 8;
}

static uint32_t tmag5170_ask(uint32_t number)
{
    return READ | number << 24;
}

void tmag5170_start(void)
{
    static const uint8_t AFTER[16] = {0, 3, 6, 5, 12, 15, 10, 9, 11, 8, 13, 14, 7, 4, 1, 2};
    for (uint32_t i = 0; i < sizeof crc_after; i++)
        crc_after[i] = AFTER[AFTER[i >> 4] ^ (i & 0xFu)];
    pairs[0] = tmag5170_whole(tmag5170_write(SYSTEM_CONFIG, TRIGGER_ALERT | TYPE_ZY));
    pairs[1] = tmag5170_whole(tmag5170_write(SYSTEM_CONFIG, TRIGGER_ALERT | TYPE_XY));
    for (uint32_t i = 0; i < AXES; i++)
        plains[i] = tmag5170_whole(tmag5170_ask(X_RESULT + i));
}

static uint8_t tmag5170_judge(uint32_t word, uint32_t inverted)
{
    if (word == UINT32_MAX)
        return WHISKER_CODE_SENSOR_ABSENT;
    if (word == 0)
        return WHISKER_CODE_SENSOR_START;
    return (tmag5170_crc(word) ^ word ^ inverted) & 0xFu ? WHISKER_CODE_SENSOR_SUM : WHISKER_CODE_OK;
}

/* A channel, 12 bits with sign, in the unit of 16. */
static int32_t tmag5170_channel(uint32_t word, const uint8_t shift[3])
{
    const uint32_t bits =
        (word >> shift[0] & 0xFu) << 12 | (word >> shift[1] & 0xFu) << 8 | (word >> shift[2] & 0xFu) << 4;
    return (int16_t)(uint16_t)bits;
}

static int32_t tmag5170_register(uint32_t word)
{
    return (int16_t)(uint16_t)(word >> 8);
}

/* The one layout that gives these registers' values; LAYOUT_PLAIN: none, or several. */
static uint8_t tmag5170_layout_of(uint32_t word, int32_t x, int32_t y)
{
    uint8_t found = LAYOUT_PLAIN;
    for (uint8_t i = 0; i < LAYOUT_COUNT; i++) {
        const struct layout *layout = &LAYOUTS[i];
        if (tmag5170_judge(word, layout->inverted) == WHISKER_CODE_OK &&
            tmag5170_channel(word, layout->shift) == (x & ~0xF) &&
            tmag5170_channel(word, layout->shift + 3) == (y & ~0xF)) {
            if (found != LAYOUT_PLAIN)
                return LAYOUT_PLAIN;
            found = i;
        }
    }
    return found;
}

static void tmag5170_compare(struct sensor *sensor, uint8_t lane)
{
    const int32_t x = tmag5170_register(tmag5170_frame(lane, tmag5170_ask(X_RESULT)));
    const int32_t y = tmag5170_register(tmag5170_frame(lane, tmag5170_ask(X_RESULT + 1)));
    (void)tmag5170_frame(lane, tmag5170_write(SYSTEM_CONFIG, TRIGGER_ALERT | TYPE_XY));
    sensor->layout = tmag5170_layout_of(tmag5170_frame(lane, tmag5170_ask(0)), x, y);
    if (sensor->layout != LAYOUT_PLAIN || ++sensor->tries == TRIES)
        sensor->kind = SENSOR_TMAG5170;
    if (sensor->layout == LAYOUT_PLAIN)
        (void)tmag5170_frame(lane, tmag5170_write(SYSTEM_CONFIG, TRIGGER_ALERT));
}

bool tmag5170_step(struct sensor *sensor, uint8_t lane)
{
    const uint32_t plain = tmag5170_write(SYSTEM_CONFIG, TRIGGER_ALERT);
    switch (sensor->step) {
    case FIND:
        (void)tmag5170_frame(lane, plain); /* an answer means something once it is of registers */
        sensor->code = tmag5170_judge(tmag5170_frame(lane, tmag5170_ask(TEST_CONFIG)), 0);
        sensor->tries = 0;
        sensor->sets = TMAG5170_SETS_NONE;
        sensor->step = CONFIGURE;
        return sensor->code == WHISKER_CODE_OK;
    case CONFIGURE:
        (void)tmag5170_frame(lane, tmag5170_write(SENSOR_CONFIG, ALL_AXES));
        (void)tmag5170_frame(lane, tmag5170_write(DEVICE_CONFIG, ACTIVE_TRIGGER));
        sensor->step = COMPARE;
        return true;
    default:
        tmag5170_compare(sensor, lane);
        return true;
    }
}

static void tmag5170_take_one(struct sensor *sensor, struct sensor_result *result, const uint32_t words[AXES])
{
    const struct layout *pair = sensor->layout == LAYOUT_PLAIN ? NULL : &LAYOUTS[sensor->layout];
    const uint32_t status = pair ? pair->status : STATUS_OF_PLAIN;
    const uint8_t before = sensor->sets;
    sensor->sets = TMAG5170_SETS_NONE; /* after a damaged reading the next one's number says nothing */
    result->code = WHISKER_CODE_OK;
    for (uint32_t i = 0; i < (pair ? 2u : AXES) && result->code == WHISKER_CODE_OK; i++)
        result->code = tmag5170_judge(words[i], pair ? pair->inverted : 0);
    /* Four bits of CRC alone let one damaged frame in 16 through. */
    if (result->code == WHISKER_CODE_OK &&
        (pair ? (words[0] ^ words[1]) & pair->same
              : ((words[0] ^ words[1]) | (words[0] ^ words[2])) >> status & SETS_MASK) != 0)
        result->code = WHISKER_CODE_SENSOR_SUM;
    if (result->code != WHISKER_CODE_OK)
        return;
    sensor->sets = (uint8_t)(words[0] >> status & SETS_MASK);
    if (sensor->sets == before)
        result->code = WHISKER_CODE_LINK_TICK; /* no conversion since */
    result->field.x = pair ? tmag5170_channel(words[0], pair->shift) : tmag5170_register(words[0]);
    result->field.y = pair ? tmag5170_channel(words[0], pair->shift + 3) : tmag5170_register(words[1]);
    result->field.z = pair ? tmag5170_channel(words[1], pair->shift) : tmag5170_register(words[2]);
}

void tmag5170_take(struct sensor *sensors, struct sensor_result *results)
{
    for (uint32_t bus = 0; bus < BOARD_BUSES; bus++)
        if (held_lanes[bus] != BOARD_LANE_NONE)
            tmag5170_take_one(&sensors[held_lanes[bus]], &results[held_lanes[bus]], held[bus]);
}

void tmag5170_read(struct sensor *sensors, const uint8_t lanes[BOARD_BUSES], void (*meanwhile)(bool taken))
{
    const bool plain = sensors[lanes[lanes[0] == BOARD_LANE_NONE]].layout == LAYOUT_PLAIN;
    const uint32_t *words = plain ? plains : pairs, frames = plain ? AXES : 2u;
    for (uint32_t i = 0; i < frames; i++) {
        const uint16_t halves[2] = {(uint16_t)(words[i] >> 16), (uint16_t)words[i]};
        uint16_t answers[BOARD_BUSES][BOARD_TRANSFER_MAX];
        board_send(lanes, halves, 2, false);
        if (i < 2)
            meanwhile(i > 0);
        board_receive(lanes, 2, answers);
        for (uint32_t bus = 0; bus < BOARD_BUSES; bus++)
            held[bus][i] = (uint32_t)answers[bus][0] << 16 | answers[bus][1];
    }
    held_lanes[0] = lanes[0];
    held_lanes[1] = lanes[1];
}

void tmag5170_again(const struct sensor *sensor, uint8_t lane)
{
    if (sensor->kind == SENSOR_TMAG5170 && sensor->layout != LAYOUT_PLAIN)
        (void)tmag5170_frame(lane, pairs[1]);
}
