#include "whisker/frame.h"

#include <assert.h>

#include "crc8.h"
#include "frame_header.h"
#include "whisker/errors.h"
#include "whisker_protocol.h"

static_assert(WHISKER_FRAME_LANES == WHISKER_LIMIT_LANES, "the host's frame has the wire's lanes");
static_assert(WHISKER_FRAME_LAST == WHISKER_FRAME_FLAG_LAST, "the host's flag is the wire's");
static_assert(WHISKER_FRAME_GAP > UINT8_MAX, "the host's own flag is outside the wire's");
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

static struct whisker_sample frame_rejected(unsigned code)
{
    return (struct whisker_sample){.status = (uint16_t)(code << WHISKER_STATUS_CODE_SHIFT)};
}

/* The bridge has checked the tick of what came from the node; here it is checked that the frame holds its own records.
 */
static void frame_decode_record(const uint8_t *record, uint8_t tick, struct whisker_sample *sample,
                                struct frame_damage *damage)
{
    if (crc8_table_driven(record, WHISKER_RECORD_CRC) != record[WHISKER_RECORD_CRC]) {
        *sample = frame_rejected(WHISKER_CODE_LINK_CRC);
        damage->damaged++;
        return;
    }
    if (record[WHISKER_RECORD_TICK] != tick) {
        *sample = frame_rejected(WHISKER_CODE_LINK_TICK);
        damage->slipped++;
        return;
    }
    sample->alpha = whisker_get_u16(record + WHISKER_RECORD_ALPHA);
    sample->beta = whisker_get_u16(record + WHISKER_RECORD_BETA);
    sample->status = whisker_get_u16(record + WHISKER_RECORD_STATUS);
    sample->reserved = 0;
}

int frame_decode(const uint8_t *bytes, struct whisker_frame *frame, struct frame_damage *damage)
{
    *damage = (struct frame_damage){0};
    const int error = frame_check_header(bytes);
    if (error) {
        return error;
    }
    frame->tick = whisker_get_u32(bytes + WHISKER_FRAME_HEADER_TICK);
    frame->time_cycles = whisker_get_u64(bytes + WHISKER_FRAME_HEADER_TIME);
    frame->sequence = whisker_get_u32(bytes + WHISKER_FRAME_HEADER_SEQUENCE);
    frame->dropped = whisker_get_u32(bytes + WHISKER_FRAME_HEADER_DROPPED);
    frame->lane_mask = whisker_get_u32(bytes + WHISKER_FRAME_HEADER_LANE_MASK);
    frame->flags = bytes[WHISKER_FRAME_HEADER_FLAGS] | (uint32_t)whisker_get_u16(bytes + WHISKER_FRAME_HEADER_USB_TIME)
                                                           << WHISKER_FRAME_USB_TIME_SHIFT;
    for (size_t lane = 0; lane < WHISKER_FRAME_LANES; lane++) {
        const uint8_t *record = bytes + WHISKER_FRAME_HEADER_BYTES + lane * WHISKER_RECORD_BYTES;
        frame_decode_record(record, (uint8_t)frame->tick, &frame->lane[lane], damage);
    }
    return damage->damaged ? WHISKER_ERROR_RECORD_CRC : damage->slipped ? WHISKER_ERROR_RECORD_TICK : WHISKER_OK;
}

int whisker_frame_decode(const uint8_t *bytes, size_t count, struct whisker_frame *frame)
{
    struct frame_damage damage;
    return count < WHISKER_FRAME_BYTES ? WHISKER_ERROR_TRUNCATED : frame_decode(bytes, frame, &damage);
}
