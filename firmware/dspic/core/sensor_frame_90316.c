#include "mlx90316_datasheet.h"
#include "sensor_frame.h"

#define REST 0x8000u /* count */

struct cause {
    uint16_t sensor, record;
};

/* The record has no bit of its own for a supply above 7 V: the offset clamp's remedy names the supply. */
static const struct cause CAUSES[] = {
    {MLX90316_F_ADCMONITOR, WHISKER_ERROR_ADC_MONITOR}, {MLX90316_F_ADCSATURA, WHISKER_ERROR_ADC_SATURATED},
    {MLX90316_F_RGTOOLOW, WHISKER_ERROR_GAIN_LOW},      {MLX90316_F_RGTOOHIGH, WHISKER_ERROR_GAIN_HIGH},
    {MLX90316_F_MAGTOOLOW, WHISKER_ERROR_FIELD_LOW},    {MLX90316_F_MAGTOOHIGH, WHISKER_ERROR_FIELD_HIGH},
    {MLX90316_F_ROCLAMP, WHISKER_ERROR_OFFSET_CLAMP},   {MLX90316_F_MT7V, WHISKER_ERROR_OFFSET_CLAMP},
};

uint16_t sensor_frame_errors(uint16_t word)
{
    uint16_t errors = 0;
    for (uint8_t i = 0; i < sizeof CAUSES / sizeof *CAUSES; i++) {
        if (word & CAUSES[i].sensor)
            errors |= CAUSES[i].record;
    }
    return errors;
}

static uint16_t sensor_frame_90316_word_at(const uint8_t *bytes)
{
    return (uint16_t)((uint16_t)bytes[0] << 8 | bytes[1]);
}

struct sensor_reading sensor_frame_decode(const uint8_t frame[SENSOR_FRAME_BYTES])
{
    const uint16_t data = sensor_frame_90316_word_at(frame + MLX90316_FRAME_DATA),
                   inverted = sensor_frame_90316_word_at(frame + MLX90316_FRAME_INVERTED);
    struct sensor_reading reading = {(uint16_t)(data & MLX90316_ANGLE_MASK), REST, 0};
    if (frame[0] != MLX90316_MASTER_START)
        return sensor_reading_of_code(WHISKER_CODE_SENSOR_START); /* the line does not even carry the master's byte */
    if (data == 0xFFFFu && inverted == 0xFFFFu)
        return sensor_reading_of_code(WHISKER_CODE_SENSOR_ABSENT);
    if ((data ^ inverted) != 0xFFFFu)
        return sensor_reading_of_code(WHISKER_CODE_SENSOR_SUM);
    if ((data & MLX90316_KIND_MASK) == MLX90316_KIND_ANGLE)
        return reading;
    reading.alpha = REST;
    reading.status = sensor_frame_errors((uint16_t)(data & ~MLX90316_KIND_MASK));
    if ((data & MLX90316_KIND_MASK) == MLX90316_KIND_ERROR && reading.status != 0)
        return reading;
    return sensor_reading_of_code(WHISKER_CODE_SENSOR_SUM); /* no such kind, or an error word that names none */
}
