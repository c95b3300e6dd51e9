#include "sensor_frame.h"

#include <stdbool.h>

#include "whisker_protocol.h" // WHISKER_SENSOR_ERRORS, WHISKER_CODE_*, whisker_get_u16

#define ASSIGNED(name, bit, sensor_bit, cause, remedy) | (uint16_t)(1u << (sensor_bit))
#define ASSIGNED_ERRORS (0u WHISKER_SENSOR_ERRORS(ASSIGNED))

uint16_t sensor_frame_errors(uint16_t word)
{
    uint16_t errors = 0;
#define COMPRESS(name, bit, sensor_bit, cause, remedy)                                                                 \
    if (word & (uint16_t)(1u << (sensor_bit)))                                                                         \
        errors |= (uint16_t)(1u << (bit));
    WHISKER_SENSOR_ERRORS(COMPRESS)
#undef COMPRESS
    return errors;
}

static uint8_t sensor_frame_sum_of(const uint8_t *bytes, uint8_t n)
{
    uint8_t sum = 0;
    for (uint8_t i = 0; i < n; i++)
        sum = (uint8_t)(sum + bytes[i]);
    return sum;
}

static bool sensor_frame_sum_is_right(const uint8_t *frame, uint16_t error_word)
{
    const uint8_t *data = frame + MLX90333_FRAME_ALPHA;
    const uint8_t sum = frame[MLX90333_FRAME_SUM];
    if ((error_word & ~ASSIGNED_ERRORS) != 0)
        return false;
    if (sum == sensor_frame_sum_of(data, MLX90333_FRAME_SUM - MLX90333_FRAME_ALPHA))
        return true;
    return error_word != 0 && sum == sensor_frame_sum_of(data, MLX90333_FRAME_ERRORS - MLX90333_FRAME_ALPHA);
}

static bool sensor_frame_all_ones(const uint8_t *frame)
{
    uint8_t common = 0xFFu;
    for (uint8_t i = 0; i < MLX90333_FRAME_BYTES; i++)
        common &= frame[i];
    return common == 0xFFu;
}

struct sensor_reading sensor_frame_decode(const uint8_t frame[MLX90333_FRAME_BYTES])
{
    const uint16_t error_word = whisker_get_u16(frame + MLX90333_FRAME_ERRORS);
    if (sensor_frame_all_ones(frame))
        return sensor_reading_of_code(WHISKER_CODE_SENSOR_ABSENT);
    if (frame[MLX90333_FRAME_START] != MLX90333_START_BYTE)
        return sensor_reading_of_code(WHISKER_CODE_SENSOR_START);
    if (!sensor_frame_sum_is_right(frame, error_word))
        return sensor_reading_of_code(WHISKER_CODE_SENSOR_SUM);
    const struct sensor_reading reading = {
        whisker_get_u16(frame + MLX90333_FRAME_ALPHA),
        whisker_get_u16(frame + MLX90333_FRAME_BETA),
        sensor_frame_errors(error_word),
    };
    return reading;
}
