#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "robot.h"

#define TICKS_PER_S 2000

/* The paper's arena in small: tiles of two floors, a box in the middle. */
static struct sim_scene arena(void)
{
    struct sim_scene scene = bench(2.5, 0.6, 0.6, 0);
    scene.tile_m = 0.5;
    scene.columns = scene.rows = 5;
    scene.textures = 2;
    strcpy(scene.texture[1], "ROUGH");
    for (size_t i = 0; i < 25; i++)
        scene.tile[i] = i % 2;
    scene.obstacles = 1;
    scene.obstacle[0] = (struct sim_box){1.0, 1.0, 1.5, 1.5, NULL};
    return scene;
}

static void run(sim_world *world, double v, double omega, double seconds)
{
    sim_world_drive(world, v, omega);
    for (long i = lround(seconds * TICKS_PER_S); i > 0; i--)
        sim_world_step(world);
}

/* Moves about, and a checksum of every field on the way. */
static double wander(uint64_t seed)
{
    struct sim_scene scene = arena();
    sim_world *world = sim_world_new(&scene, seed);
    assert_non_null(world);
    double sum = 0;
    for (int i = 0; i < 4 * TICKS_PER_S; i++) {
        if (i % 500 == 0)
            sim_world_drive(world, i % 1500 ? 0.2 : -0.1, 0.3);
        sim_world_step(world);
        struct sim_field fields[6];
        sim_world_fields(world, fields);
        for (int lane = 0; lane < 6; lane++)
            sum += (lane + 1) * fields[lane].alpha_deg + fields[lane].beta_deg * (i % 7);
    }
    double x, y, theta;
    sim_world_odometry(world, &x, &y, &theta);
    sum += x + y + theta + sim_world_pose(world).x;
    sim_world_free(world);
    return sum;
}

static void test_same_seed_same_world(void **state)
{
    (void)state;
    double one = wander(1), again = wander(1), other = wander(2);
    assert_memory_equal(&one, &again, sizeof one);
    assert_true(fabs(one - other) > 1e-6);
}

/* The body stops where it touches; the odometry of stalled wheels stops with it; turning and backing off still work. */
static void test_wall_blocks_the_body(void **state)
{
    (void)state;
    struct sim_scene scene = bench(2.5, 2.0, 1.2, 0);
    sim_world *world = sim_world_new(&scene, 1);
    double x, y, theta;
    run(world, 0.2, 0, 1);
    assert_false(sim_world_blocked(world));
    run(world, 0.2, 0, 3);
    assert_true(sim_world_blocked(world));
    struct sim_pose pose = sim_world_pose(world);
    assert_near(pose.x, 2.5 - 0.165, 0.2 / TICKS_PER_S);
    sim_world_odometry(world, &x, &y, &theta);
    assert_near(x, 0.335, 0.335 * 0.09 + 0.001);
    run(world, 0, 0.5, 1);
    assert_near(sim_world_pose(world).theta, 0.5, 1e-9);
    run(world, 0, -0.5, 1);
    run(world, -0.2, 0, 1);
    assert_near(sim_world_pose(world).x, pose.x - 0.2, 1e-6);
    sim_world_free(world);
}

static void test_box_blocks_the_body(void **state)
{
    (void)state;
    struct sim_scene scene = arena();
    scene.start = (struct sim_pose){0.6, 0.6, SIM_PI / 4}; /* at the box's corner, along the diagonal */
    sim_world *world = sim_world_new(&scene, 1);
    run(world, 0.2, 0, 4);
    struct sim_pose pose = sim_world_pose(world);
    assert_near(hypot(1 - pose.x, 1 - pose.y), 0.165, 0.2 / TICKS_PER_S);
    sim_world_free(world);
}

/* A robot put where it does not fit can still get out, but no deeper. */
static void test_too_tight_a_start(void **state)
{
    (void)state;
    struct sim_scene scene = bench(2.5, 2.45, 1.2, 0);
    sim_world *world = sim_world_new(&scene, 1);
    run(world, 0.2, 0, 0.1);
    assert_near(sim_world_pose(world).x, 2.45, 1e-12);
    run(world, -0.2, 0, 1);
    assert_near(sim_world_pose(world).x, 2.25, 1e-9);
    sim_world_free(world);
}

static void test_odometry_adds_up_to_the_motion(void **state)
{
    (void)state;
    struct sim_scene scene = bench(20, 10, 10, 0);
    sim_world *world = sim_world_new(&scene, 3);
    double x = 0, y = 0, theta = 0;
    for (int i = 0; i < 200; i++) {
        double dx, dy, dtheta;
        run(world, 0.123, 0.2, 0.1);
        sim_world_odometry(world, &dx, &dy, &dtheta);
        double degrees = dtheta / SIM_DEGREE;
        assert_near(degrees, round(degrees), 1e-9);
        x += dx * cos(theta) - dy * sin(theta);
        y += dx * sin(theta) + dy * cos(theta);
        theta += dtheta;
    }
    double limit = 0.05 + 3 * 0.01; /* of a move, and three sigma of a run */
    assert_near(theta, 20 * 0.2, 20 * 0.2 * limit + SIM_DEGREE);
    double radius = 0.123 / 0.2;
    assert_near(x, radius * sin(4), 0.15);
    assert_near(y, radius * (1 - cos(4)), 0.15);
    sim_world_free(world);
}

/* At rest in the open: white noise about a drift within 0.05. */
static void assert_noise_at_rest(enum sim_sensor sensor, double noise_deg)
{
    enum { N = 400 * TICKS_PER_S, WINDOW = TICKS_PER_S };
    struct sim_scene scene = bench(4, 2, 2, 0);
    scene.sensor = sensor;
    sim_world *world = sim_world_new(&scene, 4);
    double lowest = 1, highest = -1, square = 0, sum = 0, sum_square = 0;
    for (int n = 1; n <= N; n++) {
        struct sim_field fields[6];
        sim_world_step(world);
        sim_world_fields(world, fields);
        sum += fields[0].beta_deg / WINDOW;
        sum_square += fields[0].beta_deg * fields[0].beta_deg / WINDOW;
        if (n % WINDOW)
            continue;
        lowest = fmin(lowest, sum);
        highest = fmax(highest, sum);
        square += (sum_square - sum * sum) * WINDOW / N;
        sum = sum_square = 0;
    }
    assert_near(sqrt(square), noise_deg, noise_deg / 30);
    assert_near(highest, 0.05, 0.004);
    assert_near(lowest, -0.05, 0.004);
    sim_world_free(world);
}

static void test_noise_at_rest(void **state)
{
    (void)state;
    assert_noise_at_rest(SIM_SENSOR_MLX90333, 0.03);
    assert_noise_at_rest(SIM_SENSOR_TMAG5170, 0.0955); /* 0.1 of 60 mT, and a step of 0.05 mT over the root of 12 */
}

/* Every lane and axis has noise of its own. */
static void test_noise_is_independent(void **state)
{
    (void)state;
    enum { N = 4 * TICKS_PER_S };
    struct sim_scene scene = bench(4, 2, 2, 0);
    sim_world *world = sim_world_new(&scene, 9);
    struct sim_field before[6] = {{0}}, now[6];
    double lanes = 0, axes = 0, square = 0;
    for (int n = 0; n < N; n++) {
        sim_world_step(world);
        sim_world_fields(world, now);
        /* Differences from tick to tick leave the drift out. */
        double a = now[0].alpha_deg - before[0].alpha_deg, b = now[1].alpha_deg - before[1].alpha_deg;
        lanes += n ? a * b : 0;
        axes += n ? a * (now[0].beta_deg - before[0].beta_deg) : 0;
        square += n ? a * a : 0;
        memcpy(before, now, sizeof now);
    }
    assert_near(lanes / square, 0, 0.05);
    assert_near(axes / square, 0, 0.05);
    sim_world_free(world);
}

static void test_only_the_touching_whisker_is_tilted(void **state)
{
    (void)state;
    struct sim_scene scene = bench(4, 3.7, 2, 0);
    sim_world *world = sim_world_new(&scene, 5);
    run(world, 0.05, 0, 2.3);
    struct sim_field fields[6];
    sim_world_fields(world, fields);
    for (size_t lane = 0; lane < 4; lane++) {
        bool inner = lane == 1 || lane == 2; /* tips further forward than those of the outer ones */
        assert_int_equal(sim_world_contact(world, lane).touching, inner);
        assert_true(inner ? fabs(fields[lane].alpha_deg) > 1 : fabs(fields[lane].alpha_deg) < 0.25);
    }
    assert_near(fields[1].alpha_deg / fields[2].alpha_deg, -1, 0.3); /* mirrored */
    sim_world_free(world);
}

static void test_floor_changes_with_the_tile(void **state)
{
    (void)state;
    struct sim_scene scene = bench(2.0, 0.5, 1.0, 0);
    scene.tile_m = 1.0;
    scene.columns = scene.rows = 2;
    scene.textures = 2;
    strcpy(scene.texture[1], "ROUGH");
    memcpy(scene.tile, (unsigned char[]){0, 1, 0, 1}, 4);
    sim_world *world = sim_world_new(&scene, 6);
    double square[2] = {0};
    int count[2] = {0};
    sim_world_drive(world, 0.2, 0);
    for (int i = 0; i < 5 * TICKS_PER_S; i++) {
        struct sim_field fields[6];
        sim_world_step(world);
        sim_world_fields(world, fields);
        size_t texture = sim_world_tip(world, 4).texture;
        square[texture] += fields[4].beta_deg * fields[4].beta_deg;
        count[texture]++;
    }
    assert_near((double)count[0], 0.52 / 0.2 * TICKS_PER_S, 2); /* the tip is 20 mm behind the centre */
    assert_true(square[1] / count[1] > 4 * square[0] / count[0]);
    assert_near(sim_world_tip(world, 4).travelled_m, 1.0, 1e-9);
    sim_world_free(world);
}

/* One whisker's contacts draw from its own stream: the noise of the others does not change with them. */
static void test_lanes_do_not_disturb_each_other(void **state)
{
    (void)state;
    struct sim_scene open = bench(4, 2, 2, 0), post = open;
    post.obstacles = 1;
    post.obstacle[0] = (struct sim_box){2.17, 2.11, 2.25, 2.2, NULL}; /* where left_inner will turn to */
    sim_world *one = sim_world_new(&open, 7), *other = sim_world_new(&post, 7);
    run(one, 0, 0.1, 2);
    run(other, 0, 0.1, 2);
    struct sim_field a[6], b[6];
    sim_world_fields(one, a);
    sim_world_fields(other, b);
    assert_true(sim_world_contact(other, 1).touching);
    for (size_t lane = 2; lane < 6; lane++)
        assert_memory_equal(&a[lane], &b[lane], sizeof a[lane]);
    sim_world_free(one);
    sim_world_free(other);
}

static void test_truth_of_the_wrong_role_is_empty(void **state)
{
    (void)state;
    struct sim_scene scene = bench(4, 2, 2, 0);
    sim_world *world = sim_world_new(&scene, 8);
    assert_int_equal(sim_world_lanes(world), 6);
    assert_false(sim_world_contact(world, 5).touching);
    assert_near(sim_world_tip(world, 0).x, 0, 0);
    assert_near(sim_world_tip(world, 28).x, 0, 0);
    sim_world_free(world);
}

/* Reports take from what is not yet reported, not from the sum. */
static void test_wheels_count_what_is_reported(void **state)
{
    (void)state;
    struct sim_scene scene = bench(20, 2, 2, 0);
    sim_world *world = sim_world_new(&scene, 9);
    double distance, angle, x, y, theta, reported_x = 0, reported_theta = 0;
    for (int i = 0; i < 30; i++) {
        run(world, 0.2, 0, 0.1);
        sim_world_odometry(world, &x, &y, &theta);
        reported_x += x;
    }
    sim_world_wheels(world, &distance, &angle);
    assert_near(distance, reported_x, 1e-3);
    assert_near(angle, 0, 1e-12);
    for (int i = 0; i < 30; i++) {
        run(world, 0, 0.5, 0.1);
        sim_world_odometry(world, &x, &y, &theta);
        reported_theta += theta;
    }
    sim_world_wheels(world, &distance, &angle);
    assert_near(angle, reported_theta, SIM_DEGREE);
    sim_world_free(world);
}

/* Gap and bearing of a wall ahead, a wall on the right, and a box behind. */
static void test_gap_to_what_is_nearest(void **state)
{
    (void)state;
    double bearing;
    struct sim_scene scene = bench(4, 3.8, 2, 0.3);
    sim_world *world = sim_world_new(&scene, 1);
    assert_near(sim_world_gap(world, &bearing), 0.2 - 0.165, 1e-9);
    assert_near(bearing, -0.3, 1e-6);
    sim_world_free(world);
    scene = bench(4, 2, 0.5, 0);
    world = sim_world_new(&scene, 1);
    assert_near(sim_world_gap(world, &bearing), 0.5 - 0.165, 1e-9);
    assert_near(bearing, -SIM_PI / 2, 1e-6);
    sim_world_free(world);
    scene = bench(4, 2, 2, SIM_PI / 2);
    scene.obstacles = 1;
    scene.obstacle[0] = (struct sim_box){1, 1, 2 - 0.3, 2 - 0.4, NULL}; /* its corner lies to the left and behind */
    world = sim_world_new(&scene, 1);
    assert_near(sim_world_gap(world, &bearing), 0.5 - 0.165, 1e-9);
    assert_near(bearing, SIM_PI / 2 + atan2(0.4, 0.3), 1e-5);
    sim_world_free(world);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_same_seed_same_world),
        cmocka_unit_test(test_wall_blocks_the_body),
        cmocka_unit_test(test_box_blocks_the_body),
        cmocka_unit_test(test_too_tight_a_start),
        cmocka_unit_test(test_odometry_adds_up_to_the_motion),
        cmocka_unit_test(test_noise_at_rest),
        cmocka_unit_test(test_noise_is_independent),
        cmocka_unit_test(test_only_the_touching_whisker_is_tilted),
        cmocka_unit_test(test_floor_changes_with_the_tile),
        cmocka_unit_test(test_lanes_do_not_disturb_each_other),
        cmocka_unit_test(test_truth_of_the_wrong_role_is_empty),
        cmocka_unit_test(test_wheels_count_what_is_reported),
        cmocka_unit_test(test_gap_to_what_is_nearest),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
