#include "storm_checks.h"

#include <complex.h>
#include <math.h>

#include "mlx90333_datasheet.h"
#include "sampler.h" // SAMPLER_STEP_MOST
#include "whisker_protocol.h"

enum { BITS = 64, PAIRS = BITS * (BITS - 1) / 2 };

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

static void storm_checks_add(struct checks_odds *odds, const struct sim_node_frame *frame, uint64_t line, double share)
{
    if (line == frame->sent || !checks_pass_line(line))
        return;
    odds->passed += share;
    odds->good += checks_pass_step(frame, line) ? share : 0.0;
}

struct checks_odds checks_odds_two(const struct sim_node_frame *frame)
{
    struct checks_odds odds = {0};
    for (unsigned i = 1; i < BITS; i++)
        for (unsigned j = 0; j < i; j++)
            storm_checks_add(&odds, frame, frame->sent ^ checks_mask(i) ^ checks_mask(j), 1.0 / PAIRS);
    return odds;
}

struct checks_odds checks_odds_lost(const struct sim_node_frame *frame, bool held)
{
    struct checks_odds odds = {0};
    for (unsigned i = 0; i < BITS; i++)
        storm_checks_add(&odds, frame, checks_lost_clock(frame->sent, i, held), 1.0 / BITS);
    return odds;
}

struct checks_odds checks_odds_extra(const struct sim_node_frame *frame)
{
    struct checks_odds odds = {0};
    for (unsigned i = 0; i < BITS; i++)
        storm_checks_add(&odds, frame, checks_extra_clock(frame->sent, i), 1.0 / BITS);
    return odds;
}

/* By how much a flip of this bit changes sum of bytes less sum byte. */
static int storm_checks_change(uint64_t sent, unsigned byte, unsigned bit)
{
    const int up = (storm_checks_byte_of(sent, byte) >> bit & 1u) ? -1 : 1;
    return byte == MLX90333_FRAME_SUM ? -up * (1 << bit) : up * (1 << bit);
}

/* Start byte and error word stay whole; the changes of the other 40 bits, each made with the probability `each`, cancel
 * modulo 256 (their distribution is the product of their transforms); not all are left out. */
struct checks_odds checks_odds_noise(const struct sim_node_frame *frame, double each)
{
    static const uint8_t DATA[] = {1, 2, 3, 4, MLX90333_FRAME_SUM};
    double complex roots[256];
    double cancel = 0.0;
    for (unsigned j = 0; j < 256u; j++)
        roots[j] = cexp(8.0 * atan(1.0) / 256.0 * I * j);
    for (unsigned j = 0; j < 256u; j++) {
        double complex product = 1.0;
        for (unsigned i = 0; i < 8u * sizeof DATA; i++)
            product *=
                1.0 - each +
                each * roots[(unsigned)((int)j * storm_checks_change(frame->sent, DATA[i / 8u], i % 8u)) & 0xFFu];
        cancel += creal(product) / 256.0;
    }
    return (struct checks_odds){.passed = pow(1.0 - each, 24.0) * (cancel - pow(1.0 - each, 40.0))};
}

struct checks_odds checks_odds_cut(uint64_t record)
{
    struct checks_odds odds = {0};
    const uint8_t tick = (uint8_t)storm_checks_byte_of(record, WHISKER_RECORD_TICK);
    for (unsigned missing = 1; missing <= BITS; missing++) {
        const uint64_t read = checks_cut(record, missing);
        const bool passes = read != record && checks_pass_record(read, tick);
        odds.passed += passes / (double)BITS;
        odds.good += (passes && storm_checks_angle(read, WHISKER_RECORD_STATUS) == 0) / (double)BITS;
    }
    return odds;
}
