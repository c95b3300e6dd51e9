#include "mlx90333_model.h"

#include <string.h>

#include "sim_rng.h"
#include "whisker_protocol.h" // whisker_put_u16

/* Slow mode: 7 MHz for 20, but times are the data sheet's own (C): three times the gaps, five times t5. */
static uint32_t mlx90333_model_stretched(const struct mlx90333_parameters *p, uint32_t ns, uint32_t slow_mode_factor)
{
    return (uint32_t)((uint64_t)ns * (p->slow_mode ? slow_mode_factor : 1u) * p->slow_permille / 1000u);
}

static void mlx90333_model_start(struct mlx90333 *sensor, uint64_t now_ns)
{
    sensor->awake_ns = now_ns + (uint64_t)sensor->parameters.startup_ns * sensor->parameters.slow_permille / 1000u;
    sensor->reset_due = false;
    sensor->enabled = false;
    sensor->answering = false;
    sensor->level = true;
    mlx90333_sense_start(&sensor->sense, &sensor->parameters, now_ns);
}

void mlx90333_power_on(struct mlx90333 *sensor, uint64_t now_ns, const struct mlx90333_parameters *parameters)
{
    memset(sensor, 0, sizeof *sensor);
    sensor->parameters = *parameters;
    const struct mlx90333_parameters *p = &sensor->parameters;
    sensor->t1 = mlx90333_model_stretched(p, MLX90333_T1_NS, 3);
    sensor->t2 = mlx90333_model_stretched(p, MLX90333_T2_NS, 3);
    sensor->t4 = mlx90333_model_stretched(p, MLX90333_T4_NS, 3);
    sensor->t5 = mlx90333_model_stretched(p, MLX90333_T5_NS, 5);
    sensor->t6 = mlx90333_model_stretched(p, MLX90333_T6_NS, 3);
    sensor->t7 = mlx90333_model_stretched(p, MLX90333_T7_NS, 3);
    sensor->select_ns = now_ns;
    sensor->random = p->seed;
    sensor->select = true;
    mlx90333_model_start(sensor, now_ns);
}

void mlx90333_supply(struct mlx90333 *sensor, uint64_t now_ns, bool on)
{
    mlx90333_model_start(sensor, now_ns);
    sensor->restarting = true;
    sensor->slipped = false;
    sensor->dark = !on;
    sensor->fault = SIM_SENSOR_GOOD;
}

void mlx90333_set_field(struct mlx90333 *sensor, const struct mlx90333_field *field)
{
    if (sensor->fault != SIM_SENSOR_FROZEN)
        mlx90333_sense_field(&sensor->sense, field);
}

void mlx90333_set_fault(struct mlx90333 *sensor, enum sim_sensor_fault fault, unsigned argument)
{
    sensor->fault = (uint8_t)fault;
    sensor->argument = (uint16_t)argument;
}

static uint32_t mlx90333_model_draw(struct mlx90333 *sensor)
{
    return (uint32_t)(sim_rng_mmix(&sensor->random) >> 32);
}

static void mlx90333_model_require(struct mlx90333 *sensor, bool kept, enum mlx90333_violation violation)
{
    if (!kept && !sensor->slipped)
        sensor->violations[violation]++;
}

static void mlx90333_model_resynchronise(struct mlx90333 *sensor)
{
    sensor->enabled = true;
    sensor->slipped = false;
    sensor->answering = false;
    sensor->byte = 0;
    sensor->bit = 0;
}

static void mlx90333_model_select_fell(struct mlx90333 *sensor, uint64_t now_ns)
{
    const uint64_t since = sensor->select_ns > sensor->awake_ns ? sensor->select_ns : sensor->awake_ns;
    const uint64_t high_ns = now_ns > since ? now_ns - since : 0;
    if (mlx90333_model_draw(sensor) % sensor->t5 < high_ns) /* always from t5 on, never at 0 */
        mlx90333_model_resynchronise(sensor);
    sensor->fresh = true;
}

void mlx90333_select(struct mlx90333 *sensor, uint64_t now_ns, bool level)
{
    if (level == sensor->select)
        return;
    if (!level)
        mlx90333_model_select_fell(sensor, now_ns);
    else if (!sensor->fresh)
        mlx90333_model_require(sensor, now_ns - sensor->fall_ns >= sensor->t4, MLX90333_SELECT_HIGH);
    sensor->select = level;
    sensor->select_ns = now_ns;
    sensor->level = true; /* t9: high impedance within 1 us; ones either way until the next clock */
}

static void mlx90333_model_make_frame(struct mlx90333 *sensor, const uint16_t words[2], uint16_t errors)
{
    uint8_t *frame = sensor->frame;
    const unsigned end = sensor->parameters.sum_without_errors ? MLX90333_FRAME_ERRORS : MLX90333_FRAME_SUM;
    uint8_t sum = 0;
    frame[MLX90333_FRAME_START] = MLX90333_START_BYTE;
    whisker_put_u16(frame + MLX90333_FRAME_ALPHA, words[0]);
    whisker_put_u16(frame + MLX90333_FRAME_BETA, words[1]);
    whisker_put_u16(frame + MLX90333_FRAME_ERRORS, errors);
    for (unsigned i = MLX90333_FRAME_ALPHA; i < end; i++)
        sum = (uint8_t)(sum + frame[i]);
    frame[MLX90333_FRAME_SUM] = sum;
}

/* The angle is latched at the last clock before the first data byte. */
static void mlx90333_model_latch(struct mlx90333 *sensor, uint64_t now_ns)
{
    uint16_t words[2];
    const uint16_t errors = sensor->fault == SIM_SENSOR_ERROR_BITS ? sensor->argument : 0;
    sensor->latch_ns = now_ns;
    sensor->age_ns = mlx90333_sense_latch(&sensor->sense, now_ns, words);
    mlx90333_model_make_frame(sensor, words, errors);
    if (errors && sensor->parameters.resets_after_error)
        sensor->reset_due = true; /* once this frame has been sent */
}

const uint8_t *mlx90333_read(struct mlx90333 *sensor, uint64_t latch_ns)
{
    mlx90333_model_latch(sensor, latch_ns);
    return sensor->frame;
}

/* True if the byte before was over long enough ago. */
static bool mlx90333_model_check_byte_start(struct mlx90333 *sensor, uint64_t now_ns)
{
    const uint64_t gap = now_ns - (sensor->fresh ? sensor->select_ns : sensor->fall_ns);
    const uint32_t least = sensor->fresh ? sensor->t6 : sensor->byte == 1 ? sensor->t7 : sensor->t2;
    const bool kept = gap >= least || (sensor->byte == 0 && !sensor->fresh); /* a frame may follow at any time (A) */
    mlx90333_model_require(sensor, kept,
                           sensor->fresh       ? MLX90333_SELECT_LOW
                           : sensor->byte == 1 ? MLX90333_START_GAP
                                               : MLX90333_BYTE_GAP);
    sensor->fresh = false;
    return kept;
}

/* A rising edge shifts the next bit out. */
static void mlx90333_model_clock_rose(struct mlx90333 *sensor, uint64_t now_ns)
{
    if (sensor->bit == 0) {
        const bool loaded = mlx90333_model_check_byte_start(sensor, now_ns) || !sensor->parameters.early_byte_is_ones;
        sensor->sending = sensor->answering && sensor->byte > 0 && loaded ? sensor->frame[sensor->byte] : 0xFFu;
    } else {
        mlx90333_model_require(sensor, now_ns - sensor->rise_ns >= sensor->t1, MLX90333_CLOCK_PERIOD);
    }
    sensor->level = (sensor->sending & 0x80u) != 0;
    sensor->sending = (uint8_t)(sensor->sending << 1);
    sensor->rise_ns = now_ns;
}

static void mlx90333_model_end_byte(struct mlx90333 *sensor, uint64_t now_ns)
{
    if (sensor->byte == MLX90333_FRAME_START) {
        sensor->answering = sensor->received == MLX90333_MASTER_START;
        mlx90333_model_latch(sensor, now_ns);
    }
    sensor->byte = (uint8_t)((sensor->byte + 1u) % MLX90333_FRAME_BYTES);
    sensor->bit = 0;
    if (sensor->byte == 0 && sensor->reset_due) { /* soft reset: start-up time again, then a resynchronisation */
        mlx90333_model_start(sensor, now_ns);
        sensor->restarting = true;
    }
}

/* A falling edge samples the line. */
static void mlx90333_model_clock_fell(struct mlx90333 *sensor, uint64_t now_ns, bool master)
{
    mlx90333_model_require(sensor, master, MLX90333_ZERO_SENT);
    sensor->received = (uint8_t)(sensor->received << 1 | (master && sensor->level));
    sensor->fall_ns = now_ns;
}

/* The line as the master sees it, `position` bits into the frame. */
static bool mlx90333_model_line(struct mlx90333 *sensor, unsigned position, bool master)
{
    switch (sensor->fault) {
    case SIM_SENSOR_DEAD:
        return master;
    case SIM_SENSOR_STUCK_LOW:
        return false;
    case SIM_SENSOR_FLOATING:
        return mlx90333_model_draw(sensor) & 1u;
    case SIM_SENSOR_NOISY:
        return (master && sensor->level) != ((mlx90333_model_draw(sensor) & 0xFFFFu) < sensor->argument);
    case SIM_SENSOR_FLIP_BIT:
        return (master && sensor->level) != (position == sensor->argument);
    case SIM_SENSOR_FLIP_TWO:
        return (master && sensor->level) !=
               (position == (sensor->argument & 0xFFu) || position == sensor->argument >> 8);
    default:
        return master && sensor->level;
    }
}

/* True for both edges of the clock that the fault keeps from the sensor. */
static bool mlx90333_model_lost(struct mlx90333 *sensor, unsigned position, bool level)
{
    if (level)
        sensor->dropping = sensor->fault == SIM_SENSOR_LOST_CLOCK && position == sensor->argument;
    if (!sensor->dropping)
        return false;
    sensor->slipped = true;
    if (!level) {
        sensor->dropping = false;
        sensor->fault = SIM_SENSOR_GOOD; /* once */
    }
    return true;
}

static void mlx90333_model_edge(struct mlx90333 *sensor, uint64_t now_ns, bool level, bool master)
{
    if (level) {
        mlx90333_model_clock_rose(sensor, now_ns);
        return;
    }
    mlx90333_model_clock_fell(sensor, now_ns, master);
    if (++sensor->bit == 8u)
        mlx90333_model_end_byte(sensor, now_ns);
}

/* A falling edge that is followed by a clock of the disturbance's own, once. */
static bool mlx90333_model_doubled(struct mlx90333 *sensor, unsigned position, bool level)
{
    const bool now = !level && sensor->fault == SIM_SENSOR_EXTRA_CLOCK && position == sensor->argument;
    if (now)
        sensor->fault = SIM_SENSOR_GOOD;
    return now;
}

static void mlx90333_model_glitch(struct mlx90333 *sensor, uint64_t now_ns, bool master)
{
    sensor->slipped = true;
    mlx90333_model_edge(sensor, now_ns, true, master);
    mlx90333_model_edge(sensor, now_ns, false, master);
}

bool mlx90333_clock(struct mlx90333 *sensor, uint64_t now_ns, bool level, bool master)
{
    const unsigned position = sensor->byte * 8u + sensor->bit;
    const bool reported = sensor->select || sensor->restarting; /* the master does not know of a soft reset */
    mlx90333_model_require(sensor, reported || now_ns >= sensor->awake_ns, MLX90333_CLOCK_IN_STARTUP);
    if (sensor->select || !sensor->enabled || sensor->dark || now_ns < sensor->awake_ns)
        return mlx90333_model_line(sensor, 64u, master);
    if (mlx90333_model_lost(sensor, position, level))
        return mlx90333_model_line(sensor, position, master);
    const bool glitches = mlx90333_model_doubled(sensor, position, level);
    mlx90333_model_edge(sensor, now_ns, level, master);
    const bool seen = mlx90333_model_line(sensor, position, master);
    if (glitches)
        mlx90333_model_glitch(sensor, now_ns, master);
    return seen;
}

static bool mlx90333_model_equal_wires(const struct mlx90333 *a, const struct mlx90333 *b)
{
    return a->select == b->select && a->select_ns == b->select_ns && a->rise_ns == b->rise_ns &&
           a->fall_ns == b->fall_ns && a->level == b->level && a->fresh == b->fresh && a->slipped == b->slipped &&
           a->dropping == b->dropping && a->dark == b->dark;
}

static bool mlx90333_model_equal_frame(const struct mlx90333 *a, const struct mlx90333 *b)
{
    return a->enabled == b->enabled && a->answering == b->answering && a->byte == b->byte && a->bit == b->bit &&
           a->sending == b->sending && a->received == b->received && memcmp(a->frame, b->frame, sizeof a->frame) == 0;
}

/* A start-up that ended before the last edge of /SS leaves nothing behind. */
static bool mlx90333_model_equal_start(const struct mlx90333 *a, const struct mlx90333 *b)
{
    const bool both_over = a->awake_ns <= a->select_ns && b->awake_ns <= b->select_ns;
    return (both_over || (a->awake_ns == b->awake_ns && a->restarting == b->restarting)) &&
           a->reset_due == b->reset_due;
}

bool mlx90333_equal(const struct mlx90333 *a, const struct mlx90333 *b)
{
    return a->fault == SIM_SENSOR_GOOD && b->fault == SIM_SENSOR_GOOD && mlx90333_model_equal_wires(a, b) &&
           mlx90333_model_equal_frame(a, b) && mlx90333_model_equal_start(a, b) &&
           mlx90333_sense_equal(&a->sense, &b->sense);
}

uint32_t mlx90333_violations(const struct mlx90333 *sensor)
{
    uint32_t sum = 0;
    for (unsigned i = 0; i < MLX90333_VIOLATIONS; i++)
        sum += sensor->violations[i];
    return sum;
}
