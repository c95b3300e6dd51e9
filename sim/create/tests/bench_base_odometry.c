/* What the driver's odometry makes of moves of the emulated base, beside the truth, one line of CSV for each world.
 *
 *     bench_base_odometry MODEL kept|dropped POLICY V_M_S OMEGA_RAD_S AMOUNT FIRST_SEED SEEDS
 *
 * MODEL 1 or 2; what is less than a unit at a reading is kept or dropped; POLICY as whisker-base's --odometry. Each
 * move lasts until AMOUNT (m, or rad where V is 0) have been ordered at the speeds that the base can do, on an open
 * floor, with the wheel errors of sim/world. Columns: seed, true_m, true_rad, reported_m, reported_rad, ordered_m_s,
 * ordered_rad_s.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "create/command.h"
#include "create/odometry.h"
#include "create_ground.h"

enum { MODEL = 1, REMAINDER, POLICY, V, OMEGA, AMOUNT, FIRST_SEED, SEEDS, ARGUMENTS };
enum { TICKS_PER_S = 2000, REST_TICKS = 1000, CHUNK = 256 };

static const char OPEN_FLOOR[] =
    "size_m 1000 1000\ntile_m 1000\ntexture SMOOTH\nfloor S\nbody_radius_m 0.165\nstart 500 500 0\n";

/* Packets that odometry needs; those of the encoders last, which a Create 1 does not have. */
static const uint8_t PACKETS[] = {CREATE_OI_DISTANCE,       CREATE_OI_ANGLE,        CREATE_OI_REQUESTED_RIGHT,
                                  CREATE_OI_REQUESTED_LEFT, CREATE_OI_ENCODER_LEFT, CREATE_OI_ENCODER_RIGHT};
enum { ENCODERS = 2 };

struct bench {
    sim_create *create;
    sim_world *world;
    struct create_stream stream;
    struct create_odometry odometry;
    double true_m, true_rad, reported_m, reported_rad;
    struct sim_pose pose;
};

static void order(struct bench *bench, const uint8_t *bytes, size_t count)
{
    sim_create_receive(bench->create, bytes, count);
}

/* A tick of the world, and what the driver hears of it. */
static void tick(struct bench *bench)
{
    uint8_t bytes[CHUNK];
    struct create_frame frame;
    create_ground_drive(bench->create, bench->world);
    sim_world_step(bench->world);
    create_ground_tick(bench->create, bench->world);
    const struct sim_pose pose = sim_world_pose(bench->world);
    bench->true_m += hypot(pose.x - bench->pose.x, pose.y - bench->pose.y);
    bench->true_rad += remainder(pose.theta - bench->pose.theta, 2 * acos(-1));
    bench->pose = pose;
    for (size_t count; (count = sim_create_take(bench->create, bytes, sizeof bytes)) > 0;)
        for (size_t i = 0; i < count; i++)
            if (create_stream_push(&bench->stream, bytes[i], &frame)) {
                const struct create_step step = create_odometry_take(&bench->odometry, &frame);
                bench->reported_m += step.distance;
                bench->reported_rad += step.angle;
            }
}

static void let_pass(struct bench *bench, long ticks)
{
    for (long i = 0; i < ticks; i++)
        tick(bench);
}

static void start(struct bench *bench, enum create_model model)
{
    const size_t packets = sizeof PACKETS - (model == CREATE_2 ? 0 : ENCODERS);
    uint8_t bytes[CREATE_COMMAND_BYTES];
    order(bench, bytes, create_put_opcode(bytes, CREATE_OI_OP_START));
    order(bench, bytes, create_put_opcode(bytes, CREATE_OI_OP_FULL));
    order(bench, bytes, create_put_stream(bytes, PACKETS, packets));
    create_stream_begin(&bench->stream, PACKETS, packets);
    let_pass(bench, REST_TICKS);
}

/* The move and its line of the table. */
static void move(struct bench *bench, char **words, unsigned long seed)
{
    const double wheel_base_m = bench->odometry.settings.wheel_base_m;
    const struct create_speeds speeds =
        create_choose_speeds(bench->odometry.settings.model, wheel_base_m, atof(words[V]), atof(words[OMEGA]));
    const double speed = speeds.v_m_s != 0 ? speeds.v_m_s : speeds.omega_rad_s;
    uint8_t bytes[CREATE_COMMAND_BYTES];
    order(bench, bytes, create_put_drive_direct(bytes, speeds.right_mm_s, speeds.left_mm_s));
    let_pass(bench, lround(TICKS_PER_S * fabs(atof(words[AMOUNT]) / speed)));
    order(bench, bytes, create_put_stop(bytes));
    let_pass(bench, REST_TICKS);
    printf("%lu,%.6f,%.6f,%.6f,%.6f,%.6f,%.6f\n", seed, bench->true_m, bench->true_rad, bench->reported_m,
           bench->reported_rad, speeds.v_m_s, speeds.omega_rad_s);
}

static int policy_of(const char *name)
{
    for (int policy = CREATE_REPORTED; policy <= CREATE_AUTO; policy++)
        if (strcmp(name, create_source_name((enum create_source)policy)) == 0)
            return policy;
    return -1;
}

/* One world's move. False, with one line in error, if it could not be made. */
static bool measure(char **words, unsigned long seed, char *error, size_t size)
{
    const enum create_model model = words[MODEL][0] == '2' ? CREATE_2 : CREATE_1;
    struct sim_create_options options = sim_create_defaults(model == CREATE_2 ? CREATE_OI_V3 : CREATE_OI_V2);
    struct create_odometry_settings settings;
    struct sim_scene scene;
    if (sim_scene_parse(OPEN_FLOOR, "open floor", &scene, error, size) != 0)
        return false;
    options.drop_remainder = strcmp(words[REMAINDER], "dropped") == 0;
    create_odometry_defaults(&settings, model);
    const int policy = policy_of(words[POLICY]);
    settings.policy = policy < 0 ? settings.policy : (enum create_source)policy;
    struct bench bench = {.create = sim_create_new(&options), .world = sim_world_new(&scene, seed)};
    const bool ready = bench.create && bench.world && policy >= 0 && create_odometry_check(&settings);
    if (ready) {
        bench.pose = sim_world_pose(bench.world);
        create_odometry_begin(&bench.odometry, &settings);
        start(&bench, model);
        move(&bench, words, seed);
    } else {
        snprintf(error, size, "policy %s: this model has none; or there is no memory", words[POLICY]);
    }
    sim_create_free(bench.create);
    sim_world_free(bench.world);
    return ready;
}

int main(int argc, char **argv)
{
    char error[CHUNK];
    if (argc != ARGUMENTS) {
        fprintf(stderr, "usage: bench_base_odometry MODEL kept|dropped POLICY V OMEGA AMOUNT FIRST_SEED SEEDS\n");
        return 2;
    }
    const unsigned long first = strtoul(argv[FIRST_SEED], NULL, 10), seeds = strtoul(argv[SEEDS], NULL, 10);
    puts("seed,true_m,true_rad,reported_m,reported_rad,ordered_m_s,ordered_rad_s");
    for (unsigned long seed = first; seed < first + seeds; seed++)
        if (!measure(argv, seed, error, sizeof error)) {
            fprintf(stderr, "bench_base_odometry: %s\n", error);
            return 1;
        }
    return 0;
}
