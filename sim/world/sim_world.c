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
enum purpose { FOR_ODOMETRY = 1, FOR_CONTACTS, FOR_FLOOR, FOR_SENSOR };

struct lane {
    union {
        struct sim_object_whisker object;
        struct sim_texture_whisker texture;
    };
    struct sim_sensor_noise noise;
    struct sim_field field;
};

struct sim_world {
    struct sim_scene scene;
    const struct sim_floor_texture *floor[SIM_TEXTURES_MAX]; /* of each of the scene's textures */
    struct sim_base base;
    struct sim_odometer odometer;
    struct sim_pose pose;
    bool blocked;
    double reach; /* no object whisker reaches further from the robot's centre, m */
    uint64_t ticks;
    struct lane lane[SIM_WHISKERS_MAX];
};

static void start_lanes(sim_world *world, uint64_t seed)
{
    size_t objects = 0;
    for (uint32_t i = 0; i < world->scene.whiskers; i++) {
        const struct sim_whisker *mount = &world->scene.whisker[i];
        struct lane *lane = &world->lane[i];
        sim_sensor_noise_start(&lane->noise, sim_rng_stream(seed, FOR_SENSOR, i));
        if (mount->role == SIM_TEXTURE_WHISKER) {
            sim_texture_whisker_start(&lane->texture, mount, world->pose, sim_rng_stream(seed, FOR_FLOOR, i));
            continue;
        }
        sim_object_whisker_start(&lane->object, mount, objects++, sim_rng_stream(seed, FOR_CONTACTS, i));
        world->reach = fmax(world->reach, sim_object_whisker_reach(mount));
    }
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
        world->floor[i] = sim_floor_texture(scene->texture[i]);
    sim_odometer_start(&world->odometer, sim_rng_stream(seed, FOR_ODOMETRY, 0));
    start_lanes(world, seed);
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
static double move_body(sim_world *world)
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

static struct sim_field move_texture_whisker(sim_world *world, struct sim_texture_whisker *whisker)
{
    struct sim_point tip = sim_texture_whisker_tip(&whisker->mount, world->pose);
    const struct sim_floor_texture *floor = world->floor[sim_arena_texture(&world->scene, tip)];
    sim_texture_whisker_move(whisker, floor, world->pose);
    return sim_texture_whisker_field(whisker, floor);
}

/* near: is anything within reach of the whiskers? Gravity's constant tilt on beta is taken out by the rest calibration
 * and so is left out here. */
static struct sim_field move_object_whisker(sim_world *world, struct sim_object_whisker *whisker,
                                            struct sim_pose before, bool near)
{
    if (near || whisker->contact.touching)
        sim_object_whisker_move(whisker, &world->scene, before, world->pose);
    return (struct sim_field){SIM_FIELD_GAIN * sim_object_whisker_tilt(whisker) / SIM_DEGREE, 0};
}

void sim_world_step(sim_world *world)
{
    struct sim_pose before = world->pose;
    bool near = move_body(world) < world->reach + SIM_BASE_WHEEL_LIMIT * SIM_TICK_S;
    double time_s = (double)world->ticks++ * SIM_TICK_S;
    for (size_t i = 0; i < world->scene.whiskers; i++) {
        struct lane *lane = &world->lane[i];
        struct sim_field field = world->scene.whisker[i].role == SIM_TEXTURE_WHISKER
                                     ? move_texture_whisker(world, &lane->texture)
                                     : move_object_whisker(world, &lane->object, before, near);
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

size_t sim_world_lanes(const sim_world *world)
{
    return world->scene.whiskers;
}

struct sim_contact sim_world_contact(const sim_world *world, size_t lane)
{
    if (lane >= world->scene.whiskers || world->scene.whisker[lane].role != SIM_OBJECT_WHISKER)
        return (struct sim_contact){0};
    return world->lane[lane].object.contact;
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
    return (struct sim_tip){whisker->tip.x, whisker->tip.y, sim_arena_texture(&world->scene, whisker->tip),
                            sim_arena_inside(&world->scene, whisker->tip), whisker->travelled_m};
}
