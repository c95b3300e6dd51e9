#include "sim_world.h"

#include <math.h>
#include <stdlib.h>

#include "arena.h"
#include "base.h"
#include "object_whisker.h"
#include "sensor_noise.h"
#include "texture_whisker.h"
#include "whisker_constants.h"

/* What random numbers are drawn for: one stream per purpose and lane. */
enum purpose { FOR_ODOMETRY = 1, FOR_CONTACTS, FOR_FLOOR, FOR_SENSOR, FOR_TILES };

#define LEAST_TURN 1e-6 /* rad/s: a rate of turn nearer to its command than this has reached it */

struct lane {
    union {
        struct sim_object_whisker object;
        struct sim_texture_whisker texture;
    };
    struct sim_sensor_noise noise;
    struct sim_field field;
    size_t first_tile; /* of a texture whisker */
};

struct sim_world {
    struct sim_scene scene;
    const struct sim_floor_texture *floor[SIM_TEXTURES_MAX]; /* of each of the scene's textures */
    struct sim_base base;
    struct sim_odometer odometer;
    struct sim_pose pose;
    double turn_rate;                  /* of the whiskers' mounts, rad/s */
    double tile_height[SIM_TILES_MAX]; /* m */
    bool blocked;
    double reach; /* no object whisker reaches further from the robot's centre, m */
    uint64_t ticks;
    struct lane lane[SIM_WHISKERS_MAX];
};

static void sim_world_lay_tiles(sim_world *world, uint64_t seed)
{
    struct sim_rng rng = sim_rng_stream(seed, FOR_TILES, 0);
    for (size_t i = 0; i < world->scene.rows * world->scene.columns; i++)
        world->tile_height[i] = 1e-3 * SIM_TILE_LIFT_MM * (2 * sim_rng_uniform(&rng) - 1);
}

static const struct sim_floor_texture *sim_world_floor_at(const sim_world *world, struct sim_point at)
{
    return world->floor[sim_arena_texture(&world->scene, at)];
}

static bool sim_world_start_lanes(sim_world *world, uint64_t seed)
{
    size_t objects = 0;
    bool ok = true;
    for (uint32_t i = 0; i < world->scene.whiskers; i++) {
        const struct sim_whisker *mount = &world->scene.whisker[i];
        struct lane *lane = &world->lane[i];
        sim_sensor_noise_start(&lane->noise, world->scene.sensor, sim_rng_stream(seed, FOR_SENSOR, i));
        if (mount->role == SIM_TEXTURE_WHISKER) {
            struct sim_point tip = sim_texture_whisker_tip(mount, world->pose);
            lane->first_tile = sim_arena_tile(&world->scene, tip);
            sim_texture_whisker_start(&lane->texture, &world->scene, i, sim_world_floor_at(world, tip),
                                      sim_rng_stream(seed, FOR_FLOOR, i));
            continue;
        }
        struct sim_rng rng = sim_rng_stream(seed, FOR_CONTACTS, i);
        ok = sim_object_whisker_start(&lane->object, &world->scene, i, objects++, rng,
                                      sim_rng_stream(seed, FOR_FLOOR, i)) &&
             ok;
        world->reach = fmax(world->reach, sim_object_whisker_reach(mount));
    }
    return ok;
}

sim_world *sim_world_new(const struct sim_scene *scene, uint64_t seed)
{
    sim_world *world = calloc(1, sizeof *world);
    if (!world)
        return NULL;
    world->scene = *scene;
    world->pose = scene->start;
    world->pose.theta = sim_wrap(world->pose.theta);
    for (size_t i = 0; i < scene->textures; i++)
        world->floor[i] = mech_floor_texture(scene->texture[i]);
    sim_odometer_start(&world->odometer, sim_rng_stream(seed, FOR_ODOMETRY, 0));
    sim_world_lay_tiles(world, seed);
    if (!sim_world_start_lanes(world, seed)) {
        sim_world_free(world);
        return NULL;
    }
    return world;
}

void sim_world_free(sim_world *world)
{
    free(world);
}

void sim_world_drive(sim_world *world, double v_m_s, double omega_rad_s)
{
    if (sim_base_drive(&world->base, v_m_s, omega_rad_s))
        sim_odometer_new_move(&world->odometer);
}

/* Moves the body. Where a wall or a box is in the way the wheels stall and only turning is left; getting out of a place
 * too tight is always allowed. Returns the distance from the centre to the nearest wall or box. */
static double sim_world_move_body(sim_world *world)
{
    struct sim_pose next = sim_base_advance(&world->base, world->pose, SIM_TICK_S);
    double clearance = sim_arena_clearance(&world->scene, (struct sim_point){next.x, next.y});
    world->blocked = false;
    if (clearance < world->scene.body_radius) {
        double before = sim_arena_clearance(&world->scene, (struct sim_point){world->pose.x, world->pose.y});
        world->blocked = clearance < before;
    }
    if (world->blocked) {
        next.x = world->pose.x;
        next.y = world->pose.y;
    }
    double distance = world->blocked ? 0 : world->base.v * SIM_TICK_S;
    sim_odometer_count(&world->odometer, distance, world->base.omega * SIM_TICK_S);
    world->pose = next;
    return clearance;
}

static struct sim_field sim_world_field_of(const struct mech_whisker *whisker, const double tilt[2])
{
    double field[2];
    mech_whisker_fields(whisker, tilt, field);
    return (struct sim_field){field[0] / SIM_DEGREE, field[1] / SIM_DEGREE};
}

static struct sim_field sim_world_move_texture_whisker(sim_world *world, struct lane *lane)
{
    struct sim_texture_whisker *whisker = &lane->texture;
    struct sim_point tip = sim_texture_whisker_tip(&whisker->mount, world->pose);
    size_t tile = sim_arena_tile(&world->scene, tip);
    sim_texture_whisker_move(whisker, world->pose, world->floor[world->scene.tile[tile]],
                             world->tile_height[tile] - world->tile_height[lane->first_tile]);
    return sim_world_field_of(&whisker->drag.whisker, whisker->drag.tilt);
}

/* near: is anything within reach of the whiskers? Gravity's constant tilt on beta is taken out by the rest calibration
 * and so is left out here. */
static struct sim_field sim_world_move_object_whisker(sim_world *world, struct lane *lane, struct sim_pose before,
                                                      bool near)
{
    struct sim_object_whisker *whisker = &lane->object;
    if (near || whisker->contact.touching)
        sim_object_whisker_move(whisker, &world->scene, before, world->pose);
    sim_object_whisker_bend(whisker, world->turn_rate);
    return sim_world_field_of(&whisker->shaft.whisker, (double[2]){whisker->shaft.tilt, 0});
}

static void sim_world_follow_turn(sim_world *world)
{
    double behind = world->base.omega - world->turn_rate;
    world->turn_rate =
        fabs(behind) < LEAST_TURN ? world->base.omega : world->turn_rate + behind * SIM_TICK_S / SIM_TURN_LAG_S;
}

void sim_world_step(sim_world *world)
{
    struct sim_pose before = world->pose;
    bool near = sim_world_move_body(world) < world->reach + SIM_BASE_WHEEL_LIMIT * SIM_TICK_S;
    double time_s = (double)world->ticks++ * SIM_TICK_S;
    sim_world_follow_turn(world);
    for (size_t i = 0; i < world->scene.whiskers; i++) {
        struct lane *lane = &world->lane[i];
        struct sim_field field = world->scene.whisker[i].role == SIM_TEXTURE_WHISKER
                                     ? sim_world_move_texture_whisker(world, lane)
                                     : sim_world_move_object_whisker(world, lane, before, near);
        lane->field = sim_sensor_noise_add(&lane->noise, time_s, field);
    }
}

void sim_world_fields(const sim_world *world, struct sim_field *fields)
{
    for (size_t i = 0; i < world->scene.whiskers; i++)
        fields[i] = world->lane[i].field;
}

struct sim_pose sim_world_pose(const sim_world *world)
{
    return world->pose;
}

bool sim_world_blocked(const sim_world *world)
{
    return world->blocked;
}

void sim_world_odometry(sim_world *world, double *x_m, double *y_m, double *theta_rad)
{
    struct sim_pose motion = sim_odometer_report(&world->odometer);
    *x_m = motion.x;
    *y_m = motion.y;
    *theta_rad = motion.theta;
}

void sim_world_wheels(const sim_world *world, double *distance_m, double *angle_rad)
{
    *distance_m = world->odometer.total_mm * 1e-3;
    *angle_rad = world->odometer.total_deg * SIM_DEGREE;
}

double sim_world_gap(const sim_world *world, double *bearing_rad)
{
    const double step = 1e-6; /* m: the clearance falls fastest towards what is nearest */
    double x = world->pose.x, y = world->pose.y;
    double east = sim_arena_clearance(&world->scene, (struct sim_point){x + step, y});
    double west = sim_arena_clearance(&world->scene, (struct sim_point){x - step, y});
    double north = sim_arena_clearance(&world->scene, (struct sim_point){x, y + step});
    double south = sim_arena_clearance(&world->scene, (struct sim_point){x, y - step});
    *bearing_rad = sim_wrap(atan2(south - north, west - east) - world->pose.theta);
    return sim_arena_clearance(&world->scene, (struct sim_point){x, y}) - world->scene.body_radius;
}

size_t sim_world_lanes(const sim_world *world)
{
    return world->scene.whiskers;
}

struct sim_contact sim_world_contact(const sim_world *world, size_t lane)
{
    if (lane >= world->scene.whiskers || world->scene.whisker[lane].role != SIM_OBJECT_WHISKER)
        return (struct sim_contact){0};
    struct sim_contact contact = world->lane[lane].object.contact;
    contact.touching = contact.touching && !world->lane[lane].object.shaft.slipped;
    return contact;
}

double sim_world_spread(const sim_world *world, size_t lane)
{
    if (lane >= world->scene.whiskers || world->scene.whisker[lane].role != SIM_OBJECT_WHISKER)
        return 0.0;
    return world->lane[lane].object.spread;
}

struct sim_tip sim_world_tip(const sim_world *world, size_t lane)
{
    if (lane >= world->scene.whiskers || world->scene.whisker[lane].role != SIM_TEXTURE_WHISKER)
        return (struct sim_tip){0};
    const struct sim_texture_whisker *whisker = &world->lane[lane].texture;
    return (struct sim_tip){whisker->tip.x,
                            whisker->tip.y,
                            sim_arena_texture(&world->scene, whisker->tip),
                            sim_arena_inside(&world->scene, whisker->tip),
                            whisker->travelled_m,
                            whisker->drag.contact >= MECH_HOOKED};
}
