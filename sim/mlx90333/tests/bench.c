#include "bench.h"

struct mlx90333_parameters standard(void)
{
    struct mlx90333_parameters parameters;
    mlx90333_parameters_default(&parameters);
    return parameters;
}

void power_on(struct bench *bench, uint16_t slow_permille, uint64_t seed)
{
    struct mlx90333_parameters parameters;
    mlx90333_parameters_default(&parameters);
    parameters.slow_permille = slow_permille;
    parameters.seed = seed;
    mlx90333_power_on(&bench->sensor, 0, &parameters);
}

void set_field(struct bench *bench, double alpha_deg, double beta_deg)
{
    const struct mlx90333_field field = {.since_ns = bench->now, .alpha_deg = alpha_deg, .beta_deg = beta_deg};
    mlx90333_set_field(&bench->sensor, &field);
}

void wake(struct bench *bench, uint64_t seed)
{
    const struct bench legal = {.period = MLX90333_T1_NS,
                                .start_gap = MLX90333_T7_NS,
                                .gap = MLX90333_T2_NS,
                                .select_wait = MLX90333_T6_NS,
                                .release_wait = MLX90333_T4_NS};
    *bench = legal;
    power_on(bench, 1000, seed);
    bench->now = MLX90333_STARTUP_NS + MLX90333_T5_NS;
    mlx90333_select(&bench->sensor, bench->now, false);
    bench->now += bench->select_wait;
}

void wake_as(struct bench *bench, const struct mlx90333_parameters *parameters)
{
    wake(bench, parameters->seed);
    mlx90333_power_on(&bench->sensor, 0, parameters);
    mlx90333_select(&bench->sensor, bench->now - bench->select_wait, false);
}

uint8_t clock_bits(struct bench *bench, uint8_t send, unsigned bits)
{
    uint8_t received = 0;
    for (unsigned i = 0; i < bits; i++) {
        const bool out = ((unsigned)send >> (7 - i) & 1u) != 0;
        mlx90333_clock(&bench->sensor, bench->now, true, out);
        const bool in = mlx90333_clock(&bench->sensor, bench->now + bench->period / 2, false, out);
        received = (uint8_t)(received << 1 | in);
        bench->now += bench->period;
    }
    bench->now -= bench->period - bench->period / 2; /* gaps count from the last falling edge */
    return received;
}

void read_frame(struct bench *bench, uint8_t start, uint8_t frame[8])
{
    for (unsigned i = 0; i < 8; i++) {
        frame[i] = clock_bits(bench, i == 0 ? start : MLX90333_MASTER_BYTE, 8);
        bench->now += i == 0 ? bench->start_gap : bench->gap;
    }
}

unsigned alpha_of(struct bench *bench)
{
    uint8_t frame[8];
    read_frame(bench, 0xFF, frame);
    return (unsigned)frame[1] | (unsigned)frame[2] << 8;
}

void reselect(struct bench *bench, uint64_t high_ns)
{
    mlx90333_select(&bench->sensor, bench->now, true);
    bench->now += high_ns;
    mlx90333_select(&bench->sensor, bench->now, false);
    bench->now += bench->select_wait;
}

void assert_frame(const uint8_t frame[8], double alpha_deg, double beta_deg, unsigned errors)
{
    unsigned sum = 0;
    for (unsigned i = 1; i < 7; i++)
        sum += frame[i];
    assert_int_equal(frame[0], 0xFF);
    assert_int_equal(frame[1] | frame[2] << 8, sim_counts(alpha_deg));
    assert_int_equal(frame[3] | frame[4] << 8, sim_counts(beta_deg));
    assert_int_equal(frame[5] | frame[6] << 8, errors);
    assert_int_equal(frame[7], sum & 0xFF);
}

bool is_all_ones(const uint8_t frame[8])
{
    for (unsigned i = 0; i < 8; i++)
        if (frame[i] != 0xFF)
            return false;
    return true;
}
