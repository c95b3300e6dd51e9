#include "mlx90393.h"

#include "whisker_protocol.h" // WHISKER_CODE_*

#define EXIT 0x80u
#define RESET 0xF0u
#define READ_REGISTER 0x50u
#define WRITE_REGISTER 0x60u
#define READ_AXES 0x4Eu    /* Z, Y, X */
#define STATUS_ERROR 0x10u /* also: read before the conversion has ended */
#define GAIN 0x0000u       /* register 0: widest range, HALLCONF 0: with 0xC the fastest rates are not allowed */
#define TRIGGERED 0x4B80u  /* register 1: SPI only, pin TRIG begins a conversion of X, Y and Z */
#define FAST 0x02A0u       /* register 2: counts twice as coarse, no filter, no oversampling */
#define RESET_TICKS 8u     /* of 0.5 ms: more than the 1.5 ms it takes */
#define FINER 635          /* 1024ths: 1.96 / 3.16 */

enum step { END, BEGIN, SET, CHECK };

static const uint16_t SETTINGS[] = {GAIN, TRIGGERED, FAST};

static uint8_t mlx90393_command(uint8_t lane, uint32_t command)
{
    uint16_t words[BOARD_TRANSFER_MAX] = {(uint16_t)(command << 8)};
    board_ask(lane, words, 1, true);
    return (uint8_t)words[0];
}

/* The last byte of these two is one too many; nothing comes of it. */
static void mlx90393_set(uint8_t lane)
{
    for (uint32_t i = 0; i < sizeof SETTINGS / sizeof SETTINGS[0]; i++) {
        uint16_t words[BOARD_TRANSFER_MAX] = {(uint16_t)(WRITE_REGISTER << 8 | SETTINGS[i] >> 8),
                                              (uint16_t)(SETTINGS[i] << 8 | i << 2)};
        board_ask(lane, words, 3, true);
    }
}

/* Code of a chip that does not read back what was written: OK if it does. */
static uint8_t mlx90393_check(uint8_t lane)
{
    uint16_t words[BOARD_TRANSFER_MAX] = {READ_REGISTER << 8 | 1u << 2};
    board_ask(lane, words, 3, true);
    const uint32_t found = (words[1] & 0xFFu) << 8 | words[2] >> 8;
    return found == TRIGGERED ? WHISKER_CODE_OK : found == 0 ? WHISKER_CODE_SENSOR_START : WHISKER_CODE_SENSOR_UNKNOWN;
}

bool mlx90393_step(struct sensor *sensor, uint8_t lane)
{
    switch (sensor->step++) {
    case END:
        return mlx90393_command(lane, EXIT) != UINT8_MAX;
    case BEGIN:
        (void)mlx90393_command(lane, RESET);
        sensor->sets = 0;
        return true;
    case SET:
        if (sensor->sets++ < RESET_TICKS)
            sensor->step = SET;
        else
            mlx90393_set(lane);
        return true;
    default:
        sensor->code = mlx90393_check(lane);
        sensor->kind = sensor->code == WHISKER_CODE_OK ? SENSOR_MLX90393 : SENSOR_NONE;
        sensor->tries = 1; /* the first reading may be of the tick before */
        return sensor->kind != SENSOR_NONE;
    }
}

static uint8_t mlx90393_judge(const uint16_t words[BOARD_TRANSFER_MAX])
{
    const uint32_t common = words[1] & words[2] & words[3], any = words[1] | words[2] | words[3];
    return common == UINT16_MAX      ? WHISKER_CODE_SENSOR_ABSENT
           : words[0] & STATUS_ERROR ? WHISKER_CODE_LATE
           : any == 0                ? WHISKER_CODE_SENSOR_START
                                     : WHISKER_CODE_OK;
}

/* The sensor has no CRC. A count is 1.96 uT of X and Y, 3.16 uT of Z (data sheet): of Z's unit here. */
void mlx90393_read(struct sensor *sensor, uint8_t lane, struct sensor_result *result)
{
    uint16_t words[BOARD_TRANSFER_MAX] = {READ_AXES << 8};
    board_ask(lane, words, BOARD_TRANSFER_MAX, true);
    result->code = sensor->tries > 0 ? WHISKER_CODE_STARTING : mlx90393_judge(words);
    sensor->tries = 0;
    result->field.x = (int16_t)words[1] * FINER >> 10;
    result->field.y = (int16_t)words[2] * FINER >> 10;
    result->field.z = (int16_t)words[3];
}
