#include "frame_bytes.h"

#include <string.h>

#include "whisker_protocol.h"

static void record_bytes(uint8_t *bytes, uint32_t tick)
{
    bytes[WHISKER_RECORD_TICK] = (uint8_t)tick;
    whisker_put_u16(bytes + WHISKER_RECORD_ALPHA, 0x8000);
    whisker_put_u16(bytes + WHISKER_RECORD_BETA, 0x8000);
    whisker_put_u16(bytes + WHISKER_RECORD_STATUS, 0);
    bytes[WHISKER_RECORD_CRC] = whisker_crc8(bytes, WHISKER_RECORD_CRC);
}

void frame_bytes(uint8_t *bytes, uint32_t tick, uint8_t flags)
{
    memset(bytes, 0, WHISKER_FRAME_BYTES);
    whisker_put_u16(bytes + WHISKER_FRAME_HEADER_MAGIC, WHISKER_LIMIT_FRAME_MAGIC);
    bytes[WHISKER_FRAME_HEADER_WIRE_VERSION] = WHISKER_WIRE_VERSION;
    bytes[WHISKER_FRAME_HEADER_FLAGS] = flags;
    whisker_put_u32(bytes + WHISKER_FRAME_HEADER_TICK, tick);
    const uint64_t time = (uint64_t)tick * WHISKER_LIMIT_TICK_PERIOD;
    whisker_put_u32(bytes + WHISKER_FRAME_HEADER_TIME, (uint32_t)time);
    whisker_put_u32(bytes + WHISKER_FRAME_HEADER_TIME + 4, (uint32_t)(time >> 32));
    whisker_put_u32(bytes + WHISKER_FRAME_HEADER_SEQUENCE, tick);
    whisker_put_u32(bytes + WHISKER_FRAME_HEADER_LANE_MASK, (UINT32_C(1) << WHISKER_LIMIT_LANES) - 1);
    bytes[WHISKER_FRAME_HEADER_LANES] = WHISKER_LIMIT_LANES;
    bytes[WHISKER_FRAME_HEADER_CRC] = whisker_crc8(bytes, WHISKER_FRAME_HEADER_CRC);
    for (uint32_t lane = 0; lane < WHISKER_LIMIT_LANES; lane++) {
        record_bytes(bytes + WHISKER_FRAME_HEADER_BYTES + lane * WHISKER_RECORD_BYTES, tick);
    }
}
