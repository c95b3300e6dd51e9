#include "storm_checks.h"

#include "mlx90333_datasheet.h"
#include "sampler.h" // SAMPLER_STEP_MOST
#include "whisker_protocol.h"

enum { BITS = 64 };

static unsigned storm_checks_byte_of(uint64_t bits, unsigned n)
{
    return (unsigned)(bits >> (BITS - 8u - 8u * n) & 0xFFu);
}

static uint16_t storm_checks_angle(uint64_t line, unsigned at)
{
    return (uint16_t)(storm_checks_byte_of(line, at) | storm_checks_byte_of(line, at + 1u) << 8);
}

bool checks_pass_line(uint64_t line)
{
    unsigned sum = 0;
    for (unsigned i = MLX90333_FRAME_ALPHA; i < MLX90333_FRAME_SUM; i++)
        sum += storm_checks_byte_of(line, i);
    return storm_checks_byte_of(line, MLX90333_FRAME_START) == MLX90333_START_BYTE &&
           storm_checks_angle(line, MLX90333_FRAME_ERRORS) == 0 &&
           (sum & 0xFFu) == storm_checks_byte_of(line, MLX90333_FRAME_SUM);
}

static bool storm_checks_near(uint16_t a, uint16_t b)
{
    return (a > b ? a - b : b - a) <= (int)SAMPLER_STEP_MOST;
}

bool checks_pass_step(const struct sim_node_frame *frame, uint64_t line)
{
    return !frame->followed ||
           (storm_checks_near(frame->alpha_before, storm_checks_angle(line, MLX90333_FRAME_ALPHA)) &&
            storm_checks_near(frame->beta_before, storm_checks_angle(line, MLX90333_FRAME_BETA)));
}

bool checks_are_angles(uint64_t line, uint16_t alpha, uint16_t beta)
{
    return storm_checks_angle(line, MLX90333_FRAME_ALPHA) == alpha &&
           storm_checks_angle(line, MLX90333_FRAME_BETA) == beta;
}

bool checks_pass_record(uint64_t record, uint8_t tick)
{
    uint8_t bytes[WHISKER_RECORD_BYTES];
    for (unsigned i = 0; i < sizeof bytes; i++)
        bytes[i] = (uint8_t)storm_checks_byte_of(record, i);
    return whisker_crc8(bytes, WHISKER_RECORD_CRC) == bytes[WHISKER_RECORD_CRC] && bytes[WHISKER_RECORD_TICK] == tick;
}

bool checks_are_service(uint64_t order)
{
    uint8_t bytes[WHISKER_ORDER_BYTES];
    for (unsigned i = 0; i < sizeof bytes; i++)
        bytes[i] = (uint8_t)storm_checks_byte_of(order, i);
    return whisker_crc8(bytes, WHISKER_ORDER_CRC) == bytes[WHISKER_ORDER_CRC] &&
           bytes[WHISKER_ORDER_COMMAND] == WHISKER_COMMAND_SERVICE;
}

uint64_t checks_mask(unsigned place)
{
    return UINT64_C(1) << (BITS - 1u - place);
}

/* The bits up to, not including, `place`. */
static uint64_t storm_checks_head(unsigned place)
{
    return place == 0 ? 0 : ~UINT64_C(0) << (BITS - place);
}

uint64_t checks_lost_clock(uint64_t sent, unsigned place, bool held)
{
    const bool level = place == 0 ? held : (sent & checks_mask(place - 1u)) != 0;
    const uint64_t later = sent >> 1 & ~storm_checks_head(place) & ~checks_mask(place);
    return (sent & storm_checks_head(place)) | (level ? checks_mask(place) : 0u) | later;
}

/* After the last bit comes the first of the next frame: a one. */
uint64_t checks_extra_clock(uint64_t sent, unsigned place)
{
    const uint64_t kept = storm_checks_head(place + 1u);
    return place == BITS - 1u ? sent : (sent & kept) | ((sent << 1 | 1u) & ~kept);
}

uint64_t checks_error_word(uint64_t sent, uint16_t word)
{
    const unsigned sum = storm_checks_byte_of(sent, MLX90333_FRAME_SUM) + (word & 0xFFu) + (word >> 8);
    const uint64_t bytes = (uint64_t)(word & 0xFFu) << 16 | (uint64_t)(word >> 8) << 8 | (sum & 0xFFu);
    return (sent & ~UINT64_C(0xFFFFFF)) | bytes;
}

uint64_t checks_cut(uint64_t record, unsigned missing)
{
    const uint64_t kept = storm_checks_head(BITS - missing);
    const bool level = missing < BITS && (record & checks_mask(BITS - 1u - missing)) != 0;
    return (record & kept) | (level ? ~kept : 0u);
}
