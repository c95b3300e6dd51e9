/* Noise of one whisker's sensor: white on every sample, and a drift too slow to see in a second. */
#ifndef SIM_SENSOR_NOISE_H
#define SIM_SENSOR_NOISE_H

#include <stdint.h>

#include "sim_field.h"
#include "sim_rng.h"
#include "sim_scene.h" // enum sim_sensor

struct sim_sensor_noise {
    enum sim_sensor sensor;
    struct sim_rng rng;
    double phase[2], period_s[2]; /* of the drift: alpha, beta */
    double drift[2], until_s;     /* deg; worked out anew from this time on */
};

void sim_sensor_noise_start(struct sim_sensor_noise *noise, enum sim_sensor sensor, struct sim_rng rng);

/* The field at a time since the start, with this sample's noise added. Times must not fall. */
struct sim_field sim_sensor_noise_add(struct sim_sensor_noise *noise, double time_s, struct sim_field field);

#endif
