#include "sim_counts.h"

#include "mlx90333_sense.h" // mlx90333_counts

uint16_t sim_counts(double field_deg)
{
    static const struct mlx90333_parameters PART = {.step_counts = 16, .span_deg = 180.0};
    return mlx90333_counts(&PART, field_deg);
}
