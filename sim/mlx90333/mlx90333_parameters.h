/* What an MLX90333 may be like: EEPROM settings, spread between parts, and what no document says. */
#ifndef MLX90333_PARAMETERS_H
#define MLX90333_PARAMETERS_H

#include <stdbool.h>
#include <stdint.h>

/* Confidence letters as in the data-sheet header; `?` is not known: try both. */
struct mlx90333_parameters {
    bool slow_mode;          /* EEPROM: 7 MHz instead of 20: three times the gaps, five times t5 (C) */
    bool sum_without_errors; /* ? the sum covers bytes 1 to 4 only */
    bool resets_after_error; /* after a frame with an error word the part starts anew (A, sibling; ? this part) */
    bool early_byte_is_ones; /* ? a byte asked for before its gap is over is not loaded yet: the line stays high */
    uint16_t slow_permille;  /* times of this part in thousandths of the nominal: 900 to 1100 (D) */
    uint32_t startup_ns;     /* 10 to 16 ms nominal (A sibling, B) */
    uint32_t
        conversion_ns; /* 0: the field counts as it is at the latch; 200 000 typical, 350 000 most in fast mode, 600 000
                        * and 1 500 000 in slow (A sibling, C): then readings are 0 to one conversion old */
    uint8_t filter;    /* EEPROM 0 to 5: finite impulse response over the newest conversions (C) */
    uint16_t step_counts; /* resolution: 16 for the 12 bits the data sheet quotes (A), 1 for the word's 16 (B) */
    double span_deg;      /* EEPROM: degrees that 65536 counts stand for (D: 180) */
    double noise_deg;     /* standard deviation of one conversion (C sibling: 0.2 peak to peak fast, 0.1 slow) */
    uint64_t seed;        /* phase of the conversions, noise, undefined resynchronisations */
};

/* A fast part that is read as at the latch, noise-free, 180 degrees: what the chain runs on. */
void mlx90333_parameters_default(struct mlx90333_parameters *parameters);

#endif
