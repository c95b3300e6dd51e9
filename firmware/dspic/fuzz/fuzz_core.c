/* Fuzz target of what the core takes from outside: the sensor's frame and the bridge's order. Eight bytes serve as
 * both. A broken promise traps. */
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "record.h"
#include "sensor_frame.h"
#include "whisker_protocol.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void demand(bool kept)
{
    if (!kept)
        __builtin_trap();
}

/* A reading that is not good says why, once, and carries no angle. False: it is good, but for error bits. */
static bool check_bad(const struct sensor_reading *reading)
{
    const unsigned code = (unsigned)reading->status >> WHISKER_STATUS_CODE_SHIFT;
    if (code == WHISKER_CODE_OK)
        return false;
    demand(code >= WHISKER_CODE_SENSOR_SUM && code <= WHISKER_CODE_SENSOR_ABSENT);
    demand(reading->status == code << WHISKER_STATUS_CODE_SHIFT);
    demand(reading->alpha == 0 && reading->beta == 0);
    return true;
}

static void check_frame(const uint8_t *frame)
{
    const struct sensor_reading reading = sensor_frame_decode(frame);
    if (check_bad(&reading))
        return;
    demand(frame[MLX90333_FRAME_START] == MLX90333_START_BYTE);
    demand((reading.status == 0) == (whisker_get_u16(frame + MLX90333_FRAME_ERRORS) == 0));
    demand(reading.alpha == whisker_get_u16(frame + MLX90333_FRAME_ALPHA));
    demand(reading.beta == whisker_get_u16(frame + MLX90333_FRAME_BETA));
}

/* A frame without errors, whatever its angles, is good, and one flipped bit of it is never good. */
static void check_flip(const uint8_t *bytes, unsigned bit)
{
    uint8_t frame[MLX90333_FRAME_BYTES] = {MLX90333_START_BYTE, bytes[0], bytes[1], bytes[2], bytes[3], 0, 0, 0};
    frame[MLX90333_FRAME_SUM] = (uint8_t)(bytes[0] + bytes[1] + bytes[2] + bytes[3]);
    demand(sensor_frame_decode(frame).status == 0);
    frame[bit / 8u] ^= (uint8_t)(1u << bit % 8u);
    demand(sensor_frame_decode(frame).status != 0);
}

static void check_order(const uint8_t *bytes)
{
    uint16_t words[LINK_WORDS];
    struct order order = {0, 0};
    for (unsigned i = 0; i < LINK_WORDS; i++)
        words[i] = (uint16_t)(bytes[2u * i] << 8 | bytes[2u * i + 1u]);
    const bool right = whisker_crc8(bytes, WHISKER_ORDER_CRC) == bytes[WHISKER_ORDER_CRC];
    demand(record_parse_order(words, &order) == right);
    demand(!right || (order.tick == bytes[WHISKER_ORDER_TICK] && order.command == bytes[WHISKER_ORDER_COMMAND]));
}

/* Record and order have the same length and check, so a packed record parses. */
static void check_record(const uint8_t *bytes)
{
    const struct sensor_reading reading = {whisker_get_u16(bytes), whisker_get_u16(bytes + 2),
                                           whisker_get_u16(bytes + 4)};
    uint16_t words[LINK_WORDS];
    struct order order = {0, 0};
    record_pack(&reading, bytes[6], words);
    demand(record_parse_order(words, &order) && order.tick == bytes[6]);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    uint8_t bytes[8] = {0};
    memcpy(bytes, data, size < sizeof bytes ? size : sizeof bytes);
    check_frame(bytes);
    check_flip(bytes, bytes[4] % 64u);
    check_order(bytes);
    check_record(bytes);
    return 0;
}
