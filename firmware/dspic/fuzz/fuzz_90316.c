/* Fuzz target of the MLX90316's decoder. */
#include "demand.h"

/* Good, or good but for error bits: then the data came twice, once inverted, and says what it is. */
static void check_frame(const uint8_t *frame)
{
    const struct sensor_reading reading = sensor_frame_decode(frame);
    if (check_bad(&reading))
        return;
    demand(frame[0] == MLX90316_MASTER_START && reading.beta == 0x8000u);
    demand((frame[2] ^ frame[4]) == 0xFF && (frame[3] ^ frame[5]) == 0xFF);
    demand((frame[3] & 3u) == (reading.status == 0 ? 1u : 2u));
    demand(reading.status != 0 || reading.alpha == (frame[2] << 8 | (frame[3] & 0xFC)));
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    uint8_t frame[SENSOR_FRAME_BYTES] = {0};
    memcpy(frame, data, size < sizeof frame ? size : sizeof frame);
    check_frame(frame);
    frame[0] = MLX90316_MASTER_START;
    frame[4] = (uint8_t)~frame[2];
    frame[5] = (uint8_t)~frame[3];
    check_frame(frame);
    return 0;
}
