/* What the sensor's tests share: a hand-driven master, each of its times legal unless a test changes it. */
#ifndef MLX90333_TESTS_BENCH_H
#define MLX90333_TESTS_BENCH_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "mlx90333_model.h"

struct bench {
    struct mlx90333 sensor;
    uint64_t now;
    uint32_t period, start_gap, gap, select_wait, release_wait; /* ns */
};

struct mlx90333_parameters standard(void);

/* Powers the sensor again; with wake and wake_as it is awake, resynchronised and selected. */
void power_on(struct bench *bench, uint16_t slow_permille, uint64_t seed);
void wake(struct bench *bench, uint64_t seed);
void wake_as(struct bench *bench, const struct mlx90333_parameters *parameters);

void set_field(struct bench *bench, double alpha_deg, double beta_deg);

/* Clocks bits out, top first; returns what came in. */
uint8_t clock_bits(struct bench *bench, uint8_t send, unsigned bits);

/* A frame of eight bytes from the master, then a legal gap; alpha's word of one. */
void read_frame(struct bench *bench, uint8_t start, uint8_t frame[8]);
unsigned alpha_of(struct bench *bench);

/* /SS high for so long, then low. */
void reselect(struct bench *bench, uint64_t high_ns);

void assert_frame(const uint8_t frame[8], double alpha_deg, double beta_deg, unsigned errors);
bool is_all_ones(const uint8_t frame[8]);

#endif
