#include "whisker/frame.h"

#include <assert.h>

#include "crc8.h"
#include "frame_header.h"
#include "whisker/errors.h"
#include "whisker_protocol.h"

static_assert(WHISKER_FRAME_LANES == WHISKER_LIMIT_LANES, "the host's frame has the wire's lanes");
static_assert(WHISKER_FRAME_LAST == WHISKER_FRAME_FLAG_LAST, "the host's flag is the wire's");
static_assert(WHISKER_STATUS_ERROR_BITS == WHISKER_STATUS_CODE_SHIFT, "the host's status is the wire's");
static_assert(sizeof(struct whisker_frame) == 256, "an entry of a ring is 256 bytes");
static_assert(WHISKER_FRAME_BYTES == WHISKER_FRAME_HEADER_BYTES + WHISKER_FRAME_LANES * WHISKER_RECORD_BYTES,
              "a frame is its header and its records");

int frame_check_header(const uint8_t *bytes)
{
    if (whisker_get_u16(bytes + WHISKER_FRAME_HEADER_MAGIC) != WHISKER_LIMIT_FRAME_MAGIC) {
        return WHISKER_ERROR_MAGIC;
    }
    /* The version comes before the CRC: another version may have another header. */
    if (bytes[WHISKER_FRAME_HEADER_WIRE_VERSION] != WHISKER_WIRE_VERSION) {
        return WHISKER_ERROR_WIRE_VERSION;
    }
    if (crc8_table_driven(bytes, WHISKER_FRAME_HEADER_CRC) != bytes[WHISKER_FRAME_HEADER_CRC]) {
        return WHISKER_ERROR_HEADER_CRC;
    }
    return bytes[WHISKER_FRAME_HEADER_LANES] == WHISKER_FRAME_LANES ? WHISKER_OK : WHISKER_ERROR_LANES;
}

static bool decode_record(const uint8_t *record, struct whisker_sample *sample)
{
    if (crc8_table_driven(record, WHISKER_RECORD_CRC) != record[WHISKER_RECORD_CRC]) {
        *sample = (struct whisker_sample){.status = WHISKER_CODE_LINK_CRC << WHISKER_STATUS_CODE_SHIFT};
        return false;
    }
    sample->alpha = whisker_get_u16(record + WHISKER_RECORD_ALPHA);
    sample->beta = whisker_get_u16(record + WHISKER_RECORD_BETA);
    sample->status = whisker_get_u16(record + WHISKER_RECORD_STATUS);
    sample->reserved = 0;
    return true;
}

int whisker_frame_decode(const uint8_t *bytes, size_t count, struct whisker_frame *frame)
{
    if (count < WHISKER_FRAME_BYTES) {
        return WHISKER_ERROR_TRUNCATED;
    }
    const int error = frame_check_header(bytes);
    if (error) {
        return error;
    }
    frame->tick = whisker_get_u32(bytes + WHISKER_FRAME_HEADER_TICK);
    frame->time_cycles = whisker_get_u64(bytes + WHISKER_FRAME_HEADER_TIME);
    frame->sequence = whisker_get_u32(bytes + WHISKER_FRAME_HEADER_SEQUENCE);
    frame->dropped = whisker_get_u32(bytes + WHISKER_FRAME_HEADER_DROPPED);
    frame->lane_mask = whisker_get_u32(bytes + WHISKER_FRAME_HEADER_LANE_MASK);
    frame->flags = bytes[WHISKER_FRAME_HEADER_FLAGS];
    bool good = true;
    for (size_t lane = 0; lane < WHISKER_FRAME_LANES; lane++) {
        const uint8_t *record = bytes + WHISKER_FRAME_HEADER_BYTES + lane * WHISKER_RECORD_BYTES;
        good &= decode_record(record, &frame->lane[lane]);
    }
    return good ? WHISKER_OK : WHISKER_ERROR_RECORD_CRC;
}
