#include "sensor_noise.h"

#include <math.h>

#include "whisker_constants.h"

void sim_sensor_noise_start(struct sim_sensor_noise *noise, struct sim_rng rng)
{
    noise->rng = rng;
    for (int axis = 0; axis < 2; axis++) {
        noise->phase[axis] = 2 * SIM_PI * sim_rng_uniform(&noise->rng);
        noise->period_s[axis] =
            SIM_FIELD_DRIFT_MIN_S + (SIM_FIELD_DRIFT_MAX_S - SIM_FIELD_DRIFT_MIN_S) * sim_rng_uniform(&noise->rng);
    }
}

static double sample(struct sim_sensor_noise *noise, int axis, double time_s)
{
    double drift = sin(noise->phase[axis] + 2 * SIM_PI * time_s / noise->period_s[axis]);
    return SIM_FIELD_DRIFT_DEG * drift + SIM_FIELD_NOISE_DEG * sim_rng_normal(&noise->rng);
}

struct sim_field sim_sensor_noise_add(struct sim_sensor_noise *noise, double time_s, struct sim_field field)
{
    field.alpha_deg += sample(noise, 0, time_s);
    field.beta_deg += sample(noise, 1, time_s);
    return field;
}
