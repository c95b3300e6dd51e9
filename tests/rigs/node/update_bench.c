#include "update_bench.h"

#include <string.h>

#include "crc32.h"

enum { PATIENCE = 4 * WHISKER_LIMIT_BUSY_TICKS_MAX };

const uint8_t UPDATE_NOTHING[SERVICE_BLOCK_BYTES] = {0};

void update_seal(struct update_image *image)
{
    whisker_put_u32(image->bytes + WHISKER_IMAGE_HEADER_HEADER_CRC32,
                    crc32_of(WHISKER_CRC32_INIT, image->bytes, WHISKER_IMAGE_HEADER_HEADER_CRC32) ^
                        WHISKER_CRC32_XOR_OUT);
}

struct update_image update_image_of(uint16_t version)
{
    struct update_image image;
    uint8_t *header = image.bytes;
    memset(&image, 0, sizeof image);
    sim_update_body_fill(image.bytes + WHISKER_IMAGE_HEADER_BYTES, version);
    whisker_put_u32(header + WHISKER_IMAGE_HEADER_MAGIC, WHISKER_LIMIT_IMAGE_MAGIC);
    whisker_put_u16(header + WHISKER_IMAGE_HEADER_CHIP, WHISKER_LIMIT_CHIP_ID);
    header[WHISKER_IMAGE_HEADER_WIRE_VERSION] = WHISKER_WIRE_VERSION;
    header[WHISKER_IMAGE_HEADER_FORMAT] = WHISKER_LIMIT_IMAGE_FORMAT;
    whisker_put_u32(header + WHISKER_IMAGE_HEADER_LENGTH, UPDATE_BODY);
    whisker_put_u32(header + WHISKER_IMAGE_HEADER_BODY_CRC32,
                    crc32_of(WHISKER_CRC32_INIT, header + WHISKER_IMAGE_HEADER_BYTES, UPDATE_BODY) ^
                        WHISKER_CRC32_XOR_OUT);
    whisker_put_u16(header + WHISKER_IMAGE_HEADER_VERSION, version);
    whisker_put_u16(header + WHISKER_IMAGE_HEADER_FIRST_ROW, WHISKER_LIMIT_APPLICATION_ROW + 1u);
    update_seal(&image);
    return image;
}

/* ---------------------------------------------------------------------------------------------------------- the bus */

static void update_bench_window(struct update_bench *b, const uint8_t *out, unsigned bytes,
                                uint8_t in[WHISKER_RECORD_BYTES])
{
    sim_node_select(b->node, true);
    memset(in, 0, WHISKER_RECORD_BYTES);
    for (unsigned bit = 0; bit < 8u * bytes; bit++) {
        const bool mosi = ((unsigned)out[bit / 8u] >> (7u - bit % 8u) & 1u) != 0,
                   miso = sim_node_sck(b->node, true, mosi);
        sim_node_sck(b->node, false, mosi);
        if (bit < 8u * WHISKER_RECORD_BYTES)
            in[bit / 8u] |= (uint8_t)(miso << (7u - bit % 8u));
    }
    sim_node_select(b->node, false);
}

static bool update_bench_cuts_now(struct update_bench *b, int command, const uint8_t *argument)
{
    const bool now = b->cut.due && command == b->cut.command &&
                     (command != (int)WHISKER_SERVICE_COMMAND_BLOCK || whisker_get_u16(argument) == b->cut.block);
    b->cut.due &= !now;
    return now;
}

void update_tick(struct update_bench *b, int command, const uint8_t *argument, const uint8_t *data)
{
    uint8_t bytes[WHISKER_SERVICE_BYTES] = {++b->tick};
    bytes[WHISKER_ORDER_COMMAND] = command < 0 ? WHISKER_COMMAND_SAMPLE : WHISKER_COMMAND_SERVICE;
    bytes[WHISKER_ORDER_CRC] = whisker_crc8(bytes, WHISKER_ORDER_CRC);
    b->ticks++;
    if (update_bench_cuts_now(b, command, argument))
        sim_node_cut(b->node, b->cut.after_ns);
    sim_node_sync(b->node, (struct sim_field){0});
    update_bench_window(b, bytes, WHISKER_ORDER_BYTES, b->record);
    b->answered = false;
    if (command >= 0) {
        bytes[WHISKER_SERVICE_COMMAND] = (uint8_t)command;
        memcpy(bytes + WHISKER_SERVICE_ARGUMENT, argument, 5);
        bytes[WHISKER_SERVICE_HEAD_CRC] = whisker_crc8(bytes, WHISKER_SERVICE_HEAD_CRC);
        memcpy(bytes + WHISKER_SERVICE_DATA, data, SERVICE_BLOCK_BYTES);
        const uint32_t crc = crc32_of(WHISKER_CRC32_INIT, bytes, WHISKER_SERVICE_CRC32) ^ WHISKER_CRC32_XOR_OUT;
        for (unsigned i = 0; i < 4u; i++)
            bytes[WHISKER_SERVICE_CRC32 + i] = (uint8_t)(crc >> (24u - 8u * i) & 0xFFu);
        update_bench_window(b, bytes, WHISKER_SERVICE_BYTES, b->answer);
        b->answered = whisker_crc8(b->answer, WHISKER_RECORD_CRC) == b->answer[WHISKER_RECORD_CRC] &&
                      b->answer[WHISKER_RECORD_TICK] == b->asked &&
                      b->answer[WHISKER_RECORD_STATUS + 1u] >> 2 == WHISKER_CODE_ANSWER;
        b->asked = b->tick;
    }
    sim_node_run(b->node);
}

/* Asks, again and again if need be, until there is an answer; false if none comes. */
static bool update_bench_ask(struct update_bench *b, uint8_t command, const uint8_t *argument, const uint8_t *data,
                             uint16_t *alpha, uint16_t *beta)
{
    for (int i = 0; i < PATIENCE; i++) {
        if (i % 4 == 0)
            update_tick(b, command, argument, data);
        update_tick(b, WHISKER_SERVICE_COMMAND_POLL, UPDATE_NOTHING, UPDATE_NOTHING);
        if (b->answered && (b->answer[WHISKER_RECORD_STATUS] == command)) {
            *alpha = whisker_get_u16(b->answer + WHISKER_RECORD_ALPHA);
            *beta = whisker_get_u16(b->answer + WHISKER_RECORD_BETA);
            return true;
        }
        if (sim_node_dark(b->node))
            return false;
    }
    return false;
}

bool update_info(struct update_bench *b, uint8_t item, uint32_t *value)
{
    const uint8_t argument[5] = {item};
    uint16_t alpha = 0, beta = 0;
    const bool answered = update_bench_ask(b, WHISKER_SERVICE_COMMAND_INFO, argument, UPDATE_NOTHING, &alpha, &beta);
    *value = alpha | (uint32_t)beta << 16;
    return answered;
}

/* ------------------------------------------------------------------------------------------------------- an update */

int update_run(struct update_bench *b, const struct update_image *image, uint32_t serial)
{
    uint8_t argument[5] = {0};
    uint16_t next = 0, state = 0;
    whisker_put_u32(argument, serial);
    update_tick(b, WHISKER_SERVICE_COMMAND_ENTER, argument, UPDATE_NOTHING);
    for (int i = 0; i < PATIENCE && state != WHISKER_NODE_STATE_LOADING; i++) {
        if (!update_bench_ask(b, WHISKER_SERVICE_COMMAND_BEGIN, argument, image->bytes, &next, &state))
            return -1;
        if (state > WHISKER_NODE_STATE_COMPLETE)
            return state;
        if (state == WHISKER_NODE_STATE_APPLICATION)
            update_tick(b, WHISKER_SERVICE_COMMAND_ENTER, argument, UPDATE_NOTHING);
    }
    while (next < UPDATE_BLOCKS && state == WHISKER_NODE_STATE_LOADING) {
        uint8_t number[5] = {(uint8_t)(next & 0xFFu), (uint8_t)(next >> 8)};
        const uint8_t *block = image->bytes + WHISKER_IMAGE_HEADER_BYTES + next * SERVICE_BLOCK_BYTES;
        if (!update_bench_ask(b, WHISKER_SERVICE_COMMAND_BLOCK, number, block, &next, &state))
            return -1;
    }
    if (!update_bench_ask(b, WHISKER_SERVICE_COMMAND_FINISH, UPDATE_NOTHING, UPDATE_NOTHING, &next, &state))
        return -1;
    update_tick(b, WHISKER_SERVICE_COMMAND_RUN, argument, UPDATE_NOTHING);
    return state;
}

bool update_begin(struct update_bench *b, uint64_t seed, uint32_t serial, uint16_t chip)
{
    *b = (struct update_bench){.node = sim_node_new_named(seed, serial, chip)};
    if (b->node)
        sim_node_power_on(b->node);
    return b->node != NULL;
}

void update_ticks(struct update_bench *b, unsigned count)
{
    for (unsigned i = 0; i < count; i++)
        update_tick(b, -1, NULL, NULL);
}

int update_code(const struct update_bench *b)
{
    if (whisker_crc8(b->record, WHISKER_RECORD_CRC) != b->record[WHISKER_RECORD_CRC])
        return -1;
    return whisker_get_u16(b->record + WHISKER_RECORD_STATUS) >> WHISKER_STATUS_CODE_SHIFT;
}
