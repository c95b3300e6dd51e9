/*
 * libFuzzer target: any bytes, cut anywhere, give the same frames and counts as uncut.
 * Input: size of the chunks; a mask of frames whose header is made good (a fuzzer does not find a CRC); the stream.
 */
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "whisker/frame.h"
#include "whisker_protocol.h"

#define STREAM_MAX 2048

struct seen {
    struct whisker_decoder decoder;
    struct whisker_frame last;
};

static void feed(struct seen *seen, const uint8_t *bytes, size_t count)
{
    struct whisker_frame frame;
    while (whisker_decoder_next(&seen->decoder, &bytes, &count, &frame)) {
        seen->last = frame;
    }
    if (count != 0) {
        abort();
    }
}

static void mend_header(uint8_t *bytes)
{
    whisker_put_u16(bytes + WHISKER_FRAME_HEADER_MAGIC, WHISKER_LIMIT_FRAME_MAGIC);
    bytes[WHISKER_FRAME_HEADER_WIRE_VERSION] = WHISKER_WIRE_VERSION;
    bytes[WHISKER_FRAME_HEADER_LANES] = WHISKER_LIMIT_LANES;
    bytes[WHISKER_FRAME_HEADER_CRC] = whisker_crc8(bytes, WHISKER_FRAME_HEADER_CRC);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static uint8_t stream[STREAM_MAX];
    static struct seen whole, parts;
    if (size < 2 || size - 2 > STREAM_MAX) {
        return 0;
    }
    const size_t step = data[0] + 1u, count = size - 2;
    memcpy(stream, data + 2, count);
    for (size_t i = 0; (i + 1) * WHISKER_FRAME_BYTES <= count; i++) {
        if (data[1] >> i % 8 & 1) {
            mend_header(stream + i * WHISKER_FRAME_BYTES);
        }
    }
    memset(&whole, 0, sizeof whole);
    memset(&parts, 0, sizeof parts);
    whisker_decoder_init(&whole.decoder);
    whisker_decoder_init(&parts.decoder);
    feed(&whole, stream, count);
    for (size_t at = 0; at < count; at += step) {
        feed(&parts, stream + at, count - at < step ? count - at : step);
    }
    whisker_decoder_end(&whole.decoder);
    whisker_decoder_end(&parts.decoder);
    if (memcmp(&whole.decoder.counts, &parts.decoder.counts, sizeof whole.decoder.counts) != 0 ||
        memcmp(&whole.last, &parts.last, sizeof whole.last) != 0) {
        abort();
    }
    return 0;
}
