#include "sensor_noise.h"

#include <math.h>

#include "whisker_constants.h"

/* TMAG5170 as the Pico's firmware sets it: 12 bits of 100 mT; 0.14 mT a sample of an axis (TI: 0.025 of 32), two
 * samples. The field: a magnet of 2 by 1 mm 1 mm above the chip (docs/first_whisker.md), as far from it as the paper's.
 */
#define TMAG5170_FIELD_MT 60.0
#define TMAG5170_NOISE_MT (0.14 * 0.70711)
#define TMAG5170_STEP_MT (100.0 / 2048)

#define DRIFT_STEP_S 10e-3 /* the drift moves by less than 0.1 % of the white noise in it */

void sim_sensor_noise_start(struct sim_sensor_noise *noise, enum sim_sensor sensor, struct sim_rng rng)
{
    *noise = (struct sim_sensor_noise){.sensor = sensor, .rng = rng};
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

static double sensor_noise_axis(struct sim_sensor_noise *noise, double field_mt)
{
    const double seen = field_mt + TMAG5170_NOISE_MT * sim_rng_normal(&noise->rng);
    return TMAG5170_STEP_MT * round(seen / TMAG5170_STEP_MT);
}

/* Three axes of a magnet's field, each with its noise and in its steps, and the angles that the firmware makes of them.
 */
static struct sim_field sensor_noise_axes(struct sim_sensor_noise *noise, struct sim_field field)
{
    const double x = tan(field.alpha_deg * SIM_DEGREE), y = tan(field.beta_deg * SIM_DEGREE);
    const double z = TMAG5170_FIELD_MT / sqrt(1 + x * x + y * y);
    const double seen_x = sensor_noise_axis(noise, x * z), seen_y = sensor_noise_axis(noise, y * z);
    const double seen_z = sensor_noise_axis(noise, z);
    return (struct sim_field){atan(seen_x / seen_z) / SIM_DEGREE, atan(seen_y / seen_z) / SIM_DEGREE};
}

struct sim_field sim_sensor_noise_add(struct sim_sensor_noise *noise, double time_s, struct sim_field field)
{
    if (time_s >= noise->until_s)
        sensor_noise_drift_on(noise, time_s);
    field.alpha_deg += noise->drift[0];
    field.beta_deg += noise->drift[1];
    if (noise->sensor == SIM_SENSOR_TMAG5170)
        return sensor_noise_axes(noise, field);
    field.alpha_deg += SIM_FIELD_NOISE_DEG * sim_rng_normal(&noise->rng);
    field.beta_deg += SIM_FIELD_NOISE_DEG * sim_rng_normal(&noise->rng);
    return field;
}
