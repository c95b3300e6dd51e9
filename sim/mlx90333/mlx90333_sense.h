/* Makes the words of a frame of the magnet's field: asynchronous conversions, filter, transfer, noise. */
#ifndef MLX90333_SENSE_H
#define MLX90333_SENSE_H

#include "mlx90333_parameters.h"

#define MLX90333_FILTER_TAPS 5

/* A field that moves: value at `since_ns` and rate. Angles in degrees from rest. */
struct mlx90333_field {
    uint64_t since_ns;
    double alpha_deg, beta_deg;
    double alpha_deg_s, beta_deg_s; /* per second */
};

struct mlx90333_sense {
    const struct mlx90333_parameters *parameters;
    struct mlx90333_field field;
    double taps[MLX90333_FILTER_TAPS][2]; /* newest first: degrees from rest */
    uint64_t next_ns;                     /* time of the next conversion */
    uint64_t period_ns;
    uint64_t last_ns; /* of the newest conversion */
    uint64_t random;
};

/* `now_ns`: supply on. The parameters outlive it. */
void mlx90333_sense_start(struct mlx90333_sense *sense, const struct mlx90333_parameters *parameters, uint64_t now_ns);

/* The field changes; `field->since_ns` is the present time and never goes back. */
void mlx90333_sense_field(struct mlx90333_sense *sense, const struct mlx90333_field *field);

/* What a frame latched at `now_ns` holds: alpha and beta. Returns the age of the conversion, ns. */
uint64_t mlx90333_sense_latch(struct mlx90333_sense *sense, uint64_t now_ns, uint16_t words[2]);

/* The same field gives the same words from now on; of the parameters `a` and `b` have their own. */
bool mlx90333_sense_equal(const struct mlx90333_sense *a, const struct mlx90333_sense *b);

/* Count for an angle from rest: rest is 0x8000, held within 16 bits, rounded to the resolution. */
uint16_t mlx90333_counts(const struct mlx90333_parameters *parameters, double angle_deg);

#endif
