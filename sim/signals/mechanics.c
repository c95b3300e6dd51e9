#include "mechanics.h"

#include <math.h>
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
    sim_sensor_noise_start(&noise, sim_rng_stream(seed, FOR_SENSOR, 0));
    for (size_t i = 0; i < ticks; i++)
        mechanics_read_sensor(whisker, &noise, (double)i * tick_s, tilt + 2 * i, counts + 2 * i);
}

const struct sim_floor_texture *sim_mechanics_floor(size_t floor)
{
    return floor < SIM_FLOOR_TEXTURE_COUNT ? &SIM_FLOOR_TEXTURES[floor] : NULL;
}

enum { SHAFTS = 4, DRAGS = 8, IDLE = 16, WHISKERS = SHAFTS + DRAGS + IDLE };

#define CONTACT_M 0.110 /* the pegs stand here ... */
#define SLIDE_M 0.010   /* ... and slide by this, there and back within SLIDE_S */
#define SLIDE_S 2.0     /* s */
#define THETA_MEAN 0.09 /* rad: about 2 to 8 degrees, as of a body whisk, at most at the whisk's rate */
#define THETA_SWING 0.05
#define WHISK_RATE (SIM_PI / 24)
#define DRAG_M_S 0.1
#define TILE_M 0.3    /* every other tile ... */
#define STEP_M 0.3e-3 /* ... is higher by this */

struct sim_mechanics_scene {
    struct sim_mechanics_setting setting;
    mech_table *table;
    struct mech_shaft shaft[SHAFTS + IDLE];
    struct mech_drag drag[DRAGS];
    struct sim_sensor_noise noise[WHISKERS];
    size_t ticks;
};

sim_mechanics_scene *sim_mechanics_scene_new(const struct sim_mechanics_setting *setting, uint64_t seed)
{
    sim_mechanics_scene *scene = calloc(1, sizeof *scene);
    mech_table *table = mech_table_new();
    if (!scene || !table) {
        mech_table_free(table);
        free(scene);
        return NULL;
    }
    struct mech_stance stance = mech_stance_default();
    scene->setting = *setting;
    scene->table = table;
    for (uint32_t i = 0; i < WHISKERS; i++) {
        struct mech_whisker whisker = mech_whisker_draw(seed, i);
        sim_sensor_noise_start(&scene->noise[i], sim_rng_stream(seed, FOR_SENSOR, i));
        if (i < SHAFTS + IDLE) {
            mech_shaft_start(&scene->shaft[i], &whisker, table, setting->level, setting->tick_s);
        } else {
            mech_drag_start(&scene->drag[i - SHAFTS - IDLE], &whisker, &stance,
                            &SIM_FLOOR_TEXTURES[i % SIM_FLOOR_TEXTURE_COUNT], sim_rng_stream(seed, FOR_FLOOR, i),
                            setting->level, setting->tick_s);
        }
    }
    return scene;
}

void sim_mechanics_scene_free(sim_mechanics_scene *scene)
{
    if (scene)
        mech_table_free(scene->table);
    free(scene);
}

/* There and back between -1 and 1 at constant speed, once per period. */
static double mechanics_triangle(double time_s, double period_s)
{
    return 4 * fabs(time_s / period_s - floor(time_s / period_s + 0.5)) - 1;
}

static double mechanics_step_shafts(sim_mechanics_scene *scene, double time_s)
{
    double sum = 0;
    double theta = THETA_MEAN + THETA_SWING * mechanics_triangle(time_s, 4 * THETA_SWING / WHISK_RATE);
    double slide = scene->setting.sliding ? SLIDE_M / 2 * mechanics_triangle(time_s, SLIDE_S) : 0;
    for (int i = 0; i < SHAFTS + IDLE; i++) {
        struct mech_touch touch = {i < SHAFTS, CONTACT_M + slide, theta, 0, false};
        mech_shaft_step(&scene->shaft[i], &touch);
        sum += scene->shaft[i].tilt;
    }
    return sum;
}

static double mechanics_step_drags(sim_mechanics_scene *scene)
{
    double sum = 0;
    double travel = DRAG_M_S * scene->setting.tick_s, tile = floor(travel * (double)scene->ticks / TILE_M);
    struct mech_stroke stroke = {travel, fmod(tile, 2) * STEP_M, 0};
    for (size_t i = 0; i < DRAGS; i++) {
        mech_drag_step(&scene->drag[i], &SIM_FLOOR_TEXTURES[i % SIM_FLOOR_TEXTURE_COUNT], &stroke);
        sum += scene->drag[i].tilt[0] + scene->drag[i].tilt[1];
    }
    return sum;
}

static double mechanics_read_all(sim_mechanics_scene *scene, double time_s)
{
    uint16_t counts[2];
    double sum = 0;
    for (size_t i = 0; i < WHISKERS; i++) {
        double along[2] = {0, 0};
        bool shaft = i < SHAFTS + IDLE;
        const struct mech_whisker *whisker = shaft ? &scene->shaft[i].whisker : &scene->drag[i - SHAFTS - IDLE].whisker;
        if (shaft)
            along[0] = scene->shaft[i].tilt;
        mechanics_read_sensor(whisker, &scene->noise[i], time_s, shaft ? along : scene->drag[i - SHAFTS - IDLE].tilt,
                              counts);
        sum += counts[0] + counts[1];
    }
    return sum;
}

double sim_mechanics_scene_run(sim_mechanics_scene *scene, size_t ticks)
{
    double sum = 0;
    for (size_t i = 0; i < ticks; i++) {
        double time_s = (double)scene->ticks++ * scene->setting.tick_s;
        sum += mechanics_step_shafts(scene, time_s) + mechanics_step_drags(scene);
        if (scene->setting.counts)
            sum += mechanics_read_all(scene, time_s);
    }
    return sum;
}
