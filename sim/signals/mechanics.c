#include "mechanics.h"

#include <stdlib.h>

#include "sensor_noise.h"
#include "sim_counts.h"
#include "whisker_constants.h"

enum purpose { FOR_SENSOR = 0x7369676e, FOR_FLOOR };

void sim_mechanics_touch(struct mech_shaft *shaft, size_t ticks, const double *radius, const double *theta,
                         const double *base_rate, double *tilt, unsigned char *touches)
{
    for (size_t i = 0; i < ticks; i++) {
        struct mech_touch touch = {radius[i] > 0, radius[i], theta[i], base_rate[i], false};
        mech_shaft_step(shaft, &touch);
        tilt[i] = shaft->tilt;
        touches[i] = shaft->engaged;
    }
}

struct sim_drag {
    struct mech_drag drag;
};

struct mech_stance sim_drag_stance(void)
{
    return mech_stance_default();
}

sim_drag *sim_drag_new(const struct mech_whisker *whisker, const struct mech_stance *stance,
                       const struct sim_floor_texture *floor, uint64_t seed, int level, double tick_s)
{
    sim_drag *made = calloc(1, sizeof *made);
    if (!made)
        return NULL;
    mech_drag_start(&made->drag, whisker, stance, floor, sim_rng_stream(seed, FOR_FLOOR, 0), level, tick_s);
    return made;
}

void sim_drag_free(sim_drag *drag)
{
    free(drag);
}

void sim_drag_run(sim_drag *drag, const struct sim_floor_texture *floors, size_t ticks, const double *travel,
                  const unsigned char *floor, const double *height, double *tilt, unsigned char *event)
{
    for (size_t i = 0; i < ticks; i++) {
        struct mech_stroke stroke = {travel[i], height[i], 0};
        mech_drag_step(&drag->drag, &floors[floor[i]], &stroke);
        tilt[2 * i] = drag->drag.tilt[0];
        tilt[2 * i + 1] = drag->drag.tilt[1];
        event[i] = (unsigned char)(drag->drag.contact + (drag->drag.lifted ? 4 : 0));
    }
}

static void mechanics_read_sensor(const struct mech_whisker *whisker, struct sim_sensor_noise *noise, double time_s,
                                  const double tilt[2], uint16_t counts[2])
{
    double field[2];
    mech_whisker_fields(whisker, tilt, field);
    struct sim_field seen = {field[0] / SIM_DEGREE, field[1] / SIM_DEGREE};
    seen = sim_sensor_noise_add(noise, time_s, seen);
    counts[0] = sim_counts(seen.alpha_deg);
    counts[1] = sim_counts(seen.beta_deg);
}

void sim_mechanics_counts(const struct mech_whisker *whisker, size_t ticks, double tick_s, const double *tilt,
                          uint64_t seed, uint16_t *counts)
{
    struct sim_sensor_noise noise;
    sim_sensor_noise_start(&noise, SIM_SENSOR_MLX90333, sim_rng_stream(seed, FOR_SENSOR, 0));
    for (size_t i = 0; i < ticks; i++)
        mechanics_read_sensor(whisker, &noise, (double)i * tick_s, tilt + 2 * i, counts + 2 * i);
}

const struct sim_floor_texture *sim_mechanics_floor(size_t floor)
{
    return floor < SIM_FLOOR_TEXTURE_COUNT ? &SIM_FLOOR_TEXTURES[floor] : NULL;
}
