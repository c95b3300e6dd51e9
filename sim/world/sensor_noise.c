#include "sensor_noise.h"

#include <math.h>

#include "whisker_constants.h"

#define DRIFT_STEP_S 10e-3 /* the drift moves by less than 0.1 % of the white noise in it */

void sim_sensor_noise_start(struct sim_sensor_noise *noise, struct sim_rng rng)
{
    *noise = (struct sim_sensor_noise){.rng = rng};
    for (int axis = 0; axis < 2; axis++) {
        noise->phase[axis] = 2 * SIM_PI * sim_rng_uniform(&noise->rng);
        noise->period_s[axis] =
            SIM_FIELD_DRIFT_MIN_S + (SIM_FIELD_DRIFT_MAX_S - SIM_FIELD_DRIFT_MIN_S) * sim_rng_uniform(&noise->rng);
    }
}

static void sensor_noise_drift_on(struct sim_sensor_noise *noise, double time_s)
{
    for (int axis = 0; axis < 2; axis++)
        noise->drift[axis] =
            SIM_FIELD_DRIFT_DEG * sin(noise->phase[axis] + 2 * SIM_PI * time_s / noise->period_s[axis]);
    noise->until_s = time_s + DRIFT_STEP_S;
}

struct sim_field sim_sensor_noise_add(struct sim_sensor_noise *noise, double time_s, struct sim_field field)
{
    if (time_s >= noise->until_s)
        sensor_noise_drift_on(noise, time_s);
    field.alpha_deg += noise->drift[0] + SIM_FIELD_NOISE_DEG * sim_rng_normal(&noise->rng);
    field.beta_deg += noise->drift[1] + SIM_FIELD_NOISE_DEG * sim_rng_normal(&noise->rng);
    return field;
}
