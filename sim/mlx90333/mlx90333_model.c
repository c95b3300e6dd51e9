#include "mlx90333_model.h"

#include <string.h>

#include "whisker_protocol.h" // whisker_put_u16

static uint32_t stretched(uint32_t ns, uint32_t slow_permille)
{
    return (uint32_t)((uint64_t)ns * slow_permille / 1000u);
}

void mlx90333_power_on(struct mlx90333 *sensor, uint64_t now_ns, uint32_t slow_permille, uint64_t seed)
{
    memset(sensor, 0, sizeof *sensor);
    sensor->t1 = stretched(MLX90333_T1_NS, slow_permille);
    sensor->t2 = stretched(MLX90333_T2_NS, slow_permille);
    sensor->t4 = stretched(MLX90333_T4_NS, slow_permille);
    sensor->t5 = stretched(MLX90333_T5_NS, slow_permille);
    sensor->t6 = stretched(MLX90333_T6_NS, slow_permille);
    sensor->t7 = stretched(MLX90333_T7_NS, slow_permille);
    sensor->awake_ns = now_ns + stretched(MLX90333_STARTUP_NS, slow_permille);
    sensor->select_ns = now_ns;
    sensor->random = seed;
    sensor->select = true;
    sensor->level = true;
}

void mlx90333_set_field(struct mlx90333 *sensor, double alpha_deg, double beta_deg)
{
    sensor->alpha_deg = alpha_deg;
    sensor->beta_deg = beta_deg;
}

void mlx90333_set_fault(struct mlx90333 *sensor, enum sim_sensor_fault fault, unsigned argument)
{
    sensor->fault = (uint8_t)fault;
    sensor->argument = (uint16_t)argument;
}

/* Knuth's MMIX generator, top bits: a handful of draws per run need no better one. */
static uint32_t draw(struct mlx90333 *sensor)
{
    sensor->random = sensor->random * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (uint32_t)(sensor->random >> 32);
}

static void require(struct mlx90333 *sensor, bool kept, enum mlx90333_violation violation)
{
    if (!kept)
        sensor->violations[violation]++;
}

static void resynchronise(struct mlx90333 *sensor)
{
    sensor->enabled = true;
    sensor->answering = false;
    sensor->byte = 0;
    sensor->bit = 0;
}

static void select_fell(struct mlx90333 *sensor, uint64_t now_ns)
{
    const uint64_t since = sensor->select_ns > sensor->awake_ns ? sensor->select_ns : sensor->awake_ns;
    const uint64_t high_ns = now_ns > since ? now_ns - since : 0;
    if (draw(sensor) % sensor->t5 < high_ns) /* always from t5 on, never at 0 */
        resynchronise(sensor);
    sensor->fresh = true;
}

void mlx90333_select(struct mlx90333 *sensor, uint64_t now_ns, bool level)
{
    if (level == sensor->select)
        return;
    if (!level)
        select_fell(sensor, now_ns);
    else if (!sensor->fresh)
        require(sensor, now_ns - sensor->fall_ns >= sensor->t4, MLX90333_SELECT_HIGH);
    sensor->select = level;
    sensor->select_ns = now_ns;
    sensor->level = true; /* t9: high impedance within 1 us; ones either way until the next clock */
}

/* The angle is latched at the last clock before the first data byte. */
static void latch(struct mlx90333 *sensor)
{
    uint8_t *frame = sensor->frame;
    frame[MLX90333_FRAME_START] = MLX90333_START_BYTE;
    whisker_put_u16(frame + MLX90333_FRAME_ALPHA, sim_counts(sensor->alpha_deg));
    whisker_put_u16(frame + MLX90333_FRAME_BETA, sim_counts(sensor->beta_deg));
    whisker_put_u16(frame + MLX90333_FRAME_ERRORS, sensor->fault == SIM_SENSOR_ERROR_BITS ? sensor->argument : 0);
    uint8_t sum = 0;
    for (unsigned i = MLX90333_FRAME_ALPHA; i < MLX90333_FRAME_SUM; i++)
        sum = (uint8_t)(sum + frame[i]);
    frame[MLX90333_FRAME_SUM] = sum;
}

static void check_byte_start(struct mlx90333 *sensor, uint64_t now_ns)
{
    const uint64_t gap = now_ns - sensor->fall_ns;
    if (sensor->fresh)
        require(sensor, now_ns - sensor->select_ns >= sensor->t6, MLX90333_SELECT_LOW);
    else if (sensor->byte == 1)
        require(sensor, gap >= sensor->t7, MLX90333_START_GAP);
    else
        require(sensor, gap >= sensor->t2, MLX90333_BYTE_GAP);
    sensor->fresh = false;
}

/* A rising edge shifts the next bit out. */
static void clock_rose(struct mlx90333 *sensor, uint64_t now_ns)
{
    if (sensor->bit == 0) {
        check_byte_start(sensor, now_ns);
        sensor->sending = sensor->answering && sensor->byte > 0 ? sensor->frame[sensor->byte] : 0xFFu;
    } else {
        require(sensor, now_ns - sensor->rise_ns >= sensor->t1, MLX90333_CLOCK_PERIOD);
    }
    sensor->level = (sensor->sending & 0x80u) != 0;
    sensor->sending = (uint8_t)(sensor->sending << 1);
    sensor->rise_ns = now_ns;
}

static void end_byte(struct mlx90333 *sensor)
{
    if (sensor->byte == MLX90333_FRAME_START) {
        sensor->answering = sensor->received == MLX90333_MASTER_BYTE;
        latch(sensor);
    }
    sensor->byte = (uint8_t)((sensor->byte + 1u) % MLX90333_FRAME_BYTES);
    sensor->bit = 0;
}

/* A falling edge samples the line. */
static void clock_fell(struct mlx90333 *sensor, uint64_t now_ns, bool master)
{
    require(sensor, master, MLX90333_ZERO_SENT);
    sensor->received = (uint8_t)(sensor->received << 1 | (master && sensor->level));
    sensor->fall_ns = now_ns;
}

/* The line as the master sees it, `position` bits into the frame. */
static bool line(const struct mlx90333 *sensor, unsigned position, bool master)
{
    switch (sensor->fault) {
    case SIM_SENSOR_DEAD:
        return master;
    case SIM_SENSOR_STUCK_LOW:
        return false;
    case SIM_SENSOR_FLIP_BIT:
        return (master && sensor->level) != (position == sensor->argument);
    default:
        return master && sensor->level;
    }
}

bool mlx90333_clock(struct mlx90333 *sensor, uint64_t now_ns, bool level, bool master)
{
    const unsigned position = sensor->byte * 8u + sensor->bit;
    require(sensor, sensor->select || now_ns >= sensor->awake_ns, MLX90333_CLOCK_IN_STARTUP);
    if (sensor->select || !sensor->enabled || now_ns < sensor->awake_ns)
        return sensor->fault == SIM_SENSOR_STUCK_LOW ? false : master;
    if (level) {
        clock_rose(sensor, now_ns);
    } else {
        clock_fell(sensor, now_ns, master);
        if (++sensor->bit == 8u)
            end_byte(sensor);
    }
    return line(sensor, position, master);
}

uint32_t mlx90333_violations(const struct mlx90333 *sensor)
{
    uint32_t sum = 0;
    for (unsigned i = 0; i < MLX90333_VIOLATIONS; i++)
        sum += sensor->violations[i];
    return sum;
}
