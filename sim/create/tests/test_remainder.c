/* Whether the driver finds out how the emulated Create 1 treats remainders, while it explores as the robot does.
 *
 * Many seeded runs of each way: legs ahead, turns and body whisks of random lengths, cut short by what is met; wheel
 * errors of up to 5 % in all, part for the run and part for each move; a body that is held for a while; a line that
 * loses bytes. With a number after it the program makes so many runs and prints of each: way, seed, verdict, seconds.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "create/command.h"
#include "create/odometry.h"
#include "sim_create.h"
#include "sim_rng.h"

enum { RUNS = 200, PACKETS = 4, RUN_S = 60, TICKS_PER_S = 2000, CHUNK = 256, FOR_THIS_TEST = 77 };
#define LOST_BYTES 3e-4 /* one frame in a hundred or so */
#define HELD 0.1        /* of the moves: the body stands all the while */
#define ERROR 0.05      /* greatest, of a wheel */
#define SOON_S 10.0
#define SOON 0.9 /* of the runs have their verdict by then */

static const uint8_t packets[PACKETS] = {CREATE_OI_DISTANCE, CREATE_OI_ANGLE, CREATE_OI_REQUESTED_RIGHT,
                                         CREATE_OI_REQUESTED_LEFT};

/* What an exploring robot orders in turn (docs/methods/behaviour.md): mm/s of the right and the left wheel, how
 * long, s, and whether only where something was met. Turns go to either side. */
static const struct move {
    int32_t right, left;
    double least_s, most_s;
    bool met;
} moves[] = {
    {150, 150, 0.2, 8, false}, {-30, -30, 0.1, 1, true},     {17, -17, 0.2, 1.5, true},  {-17, 17, 0.2, 1.5, true},
    {0, 0, 0.1, 0.2, true},    {-150, -150, 0.3, 0.6, true}, {92, -92, 0.6, 3.7, false},
};
enum { MOVES = sizeof moves / sizeof moves[0] };

struct explorer {
    struct sim_rng rng;
    sim_create *create;
    struct sim_create_motion motion;
    struct create_stream stream;
    struct create_odometry odometry;
    enum create_remainder truth;
    bool wrong; /* at any time */
    double error, gain_distance, gain_angle;
    unsigned long ticks, decided; /* until the verdict; 0: none */
};

static double between(struct explorer *explorer, double least, double most)
{
    return least + (most - least) * sim_rng_uniform(&explorer->rng);
}

static void hear(struct explorer *explorer)
{
    uint8_t bytes[CHUNK];
    struct create_frame frame;
    const size_t count = sim_create_take(explorer->create, bytes, sizeof bytes);
    for (size_t i = 0; i < count; i++) {
        if (create_stream_push(&explorer->stream, bytes[i], &frame)) {
            create_odometry_take(&explorer->odometry, &frame);
        }
    }
}

static void pass_tick(struct explorer *explorer)
{
    double v, omega;
    sim_create_speed(explorer->create, &v, &omega);
    explorer->motion.distance_m += v * explorer->gain_distance / TICKS_PER_S;
    explorer->motion.angle_rad += omega * explorer->gain_angle / TICKS_PER_S;
    sim_create_tick(explorer->create, &explorer->motion);
    hear(explorer);
    explorer->ticks++;
    if (explorer->odometry.remainder != CREATE_UNKNOWN) {
        explorer->decided = explorer->decided > 0 ? explorer->decided : explorer->ticks;
        explorer->wrong = explorer->wrong || explorer->odometry.remainder != explorer->truth;
    }
}

static void make_move(struct explorer *explorer, const struct move *move, bool mirrored)
{
    uint8_t bytes[CREATE_COMMAND_BYTES];
    const bool held = sim_rng_uniform(&explorer->rng) < HELD;
    const double seconds = between(explorer, move->least_s, move->most_s), rest = ERROR - fabs(explorer->error);
    explorer->gain_distance = held ? 0 : 1 + explorer->error + between(explorer, -rest, rest);
    explorer->gain_angle = held ? 0 : 1 + explorer->error + between(explorer, -rest, rest);
    sim_create_receive(explorer->create, bytes,
                       mirrored ? create_put_drive_direct(bytes, move->left, move->right)
                                : create_put_drive_direct(bytes, move->right, move->left));
    for (long i = 0; i < lround(seconds * TICKS_PER_S); i++) {
        pass_tick(explorer);
    }
}

/* A leg, half of the time an object at its end, a turn. */
static void go_round(struct explorer *explorer)
{
    const bool met = sim_rng_uniform(&explorer->rng) < 0.5, mirrored = sim_rng_uniform(&explorer->rng) < 0.5;
    for (size_t i = 0; i < MOVES; i++) {
        if (met || !moves[i].met) {
            make_move(explorer, &moves[i], mirrored);
        }
    }
}

static void start(struct explorer *explorer)
{
    uint8_t bytes[CREATE_COMMAND_BYTES];
    sim_create_receive(explorer->create, bytes, create_put_opcode(bytes, CREATE_OI_OP_START));
    sim_create_receive(explorer->create, bytes, create_put_opcode(bytes, CREATE_OI_OP_FULL));
    sim_create_receive(explorer->create, bytes, create_put_stream(bytes, packets, PACKETS));
    create_stream_begin(&explorer->stream, packets, PACKETS);
}

/* A run, seen to its end: a wrong verdict may come late. */
static struct explorer explore(bool drops, uint64_t seed)
{
    struct explorer explorer = {.rng = sim_rng_stream(seed, FOR_THIS_TEST, drops),
                                .truth = drops ? CREATE_DROPPED : CREATE_KEPT};
    struct sim_create_options options = sim_create_defaults(CREATE_OI_V2);
    struct create_odometry_settings settings;
    options.drop_remainder = drops;
    options.lose = LOST_BYTES;
    options.seed = seed;
    explorer.create = sim_create_new(&options);
    assert_non_null(explorer.create);
    create_odometry_defaults(&settings, CREATE_1);
    create_odometry_begin(&explorer.odometry, &settings);
    start(&explorer);
    explorer.error = between(&explorer, -ERROR, ERROR);
    while (explorer.ticks < RUN_S * TICKS_PER_S) {
        go_round(&explorer);
    }
    sim_create_free(explorer.create);
    return explorer;
}

static bool tell; /* each run */
static uint64_t runs = RUNS;

static void never_wrong(bool drops)
{
    unsigned soon = 0;
    for (uint64_t seed = 1; seed <= runs; seed++) {
        const struct explorer explorer = explore(drops, seed);
        const double seconds = (double)explorer.decided / TICKS_PER_S;
        if (tell) {
            printf("%s %u %s %.2f\n", drops ? "dropped" : "kept", (unsigned)seed, explorer.wrong ? "WRONG" : "right",
                   seconds);
        }
        assert_false(explorer.wrong);
        assert_true(explorer.decided > 0);
        soon += seconds <= SOON_S;
    }
    assert_true(tell || (double)soon >= SOON * (double)runs);
}

static void test_kept(void **state)
{
    (void)state;
    never_wrong(false);
}

static void test_dropped(void **state)
{
    (void)state;
    never_wrong(true);
}

int main(int argc, char **argv)
{
    tell = argc > 1;
    runs = tell ? strtoul(argv[1], NULL, 10) : RUNS;
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_kept), cmocka_unit_test(test_dropped)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
