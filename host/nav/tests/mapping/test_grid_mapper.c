/* Grid maps that share leaves, what they expect of whiskers, the Gaussian between two draws, and the particles on
 * hand-made rows; and how well a path explains rows. */
#include "grid_mapper.h"

#include <stdlib.h>
#include <string.h>

#include "count_allocations.h"
#include "grid_motion.h"
#include "grid_path.h"
#include "grid_sense.h"
#include "near.h"
#include "rooms.h"
#include "wall.h"

static void test_a_copy_shares_until_it_is_written(void **state)
{
    (void)state;
    struct nav_grid_pool pool;
    struct nav_grid_map a = {.node = {0}}, b = {.node = {0}};
    assert_int_equal(nav_grid_pool_init(&pool, 2, 3), 0);
    nav_grid_cell_for(&pool, &a, 512, 512)->hits = 1.0F;
    nav_grid_cell_for(&pool, &a, 300, 700)->hits = 2.0F;
    assert_int_equal(pool.spare_leaves, 1);
    nav_grid_map_copy(&pool, &b, &a);
    assert_int_equal(pool.spare_leaves, 1); /* nothing was copied */
    nav_grid_cell_for(&pool, &b, 512, 512)->hits = 5.0F;
    assert_int_equal(pool.spare_leaves, 0); /* one leaf was */
    assert_near(nav_grid_cell_at(&pool, &a, 512, 512)->hits, 1.0, 0.0);
    assert_near(nav_grid_cell_at(&pool, &b, 512, 512)->hits, 5.0, 0.0);
    assert_near(nav_grid_cell_at(&pool, &b, 300, 700)->hits, 2.0, 0.0);
    assert_null(nav_grid_cell_for(&pool, &b, 300, 700)); /* no room for a leaf of its own */
    assert_int_equal(pool.refused, 1);
    assert_null(nav_grid_cell_for(&pool, &b, -1, 0)); /* beyond the map */
    nav_grid_map_clear(&pool, &a);
    assert_int_equal(pool.spare_leaves, 1);
    assert_near(nav_grid_cell_at(&pool, &b, 300, 700)->hits, 2.0, 0.0);
    nav_grid_map_clear(&pool, &b);
    assert_int_equal(pool.spare_leaves, 3);
    assert_int_equal(pool.spare_nodes, 3);
    nav_grid_pool_free(&pool);
}

/* Contacts along x = 0.5 m, whiskers along x. */
static void test_contacts_make_a_surface(void **state)
{
    (void)state;
    struct nav_grid_pool pool;
    struct nav_grid_map map = {.node = {0}};
    struct nav_grid_surface f;
    struct nav_grid_whisker w = {.x = 0.4, .c = 1.0, .length = 0.2, .sigma = 0.005, .miss = 0.1, .ghost = 0.01};
    assert_int_equal(nav_grid_pool_init(&pool, 2, 100), 0);
    struct nav_grid grid = {&pool, &map};
    assert_false(nav_grid_surface(grid, 0.5, 0.0, &w, &f));
    double before = nav_grid_contact(grid, &w, 0.1);
    for (int n = -4; n <= 4; n++) {
        w.y = 0.01 * n;
        nav_grid_learn_contact(grid, &w, 0.1, 1.0);
    }
    w.y = 0.0;
    assert_true(nav_grid_surface(grid, 0.51, 0.0, &w, &f));
    assert_near(f.x, 0.5, 1e-6);
    assert_near(f.y, 0.0, 0.001); /* cells do not lie evenly about it */
    assert_near(f.nx, -1.0, 1e-6);
    assert_near(f.facing, 1.0, 1e-6);
    assert_true(nav_grid_contact(grid, &w, 0.1) > before + 1.0);
    assert_true(nav_grid_contact(grid, &w, 0.1) > nav_grid_contact(grid, &w, 0.15) + 2.0); /* beyond a wall */
    assert_true(nav_grid_contact(grid, &w, INFINITY) < -0.4);                              /* through it */
    w.x = 0.28;
    /* Short of it: six cells of which nothing is known, two that three whiskers went through, and no ghost. */
    assert_near(nav_grid_contact(grid, &w, INFINITY), log(0.99) + 6.0 * log(1.0 - 0.018) + 2.0 * log(1.0 - 0.018 / 3.7),
                1e-5);
    nav_grid_pool_free(&pool);
}

static void test_a_texture_is_expected_where_it_was_read(void **state)
{
    (void)state;
    struct nav_grid_pool pool;
    struct nav_grid_map map = {.node = {0}};
    static const float first[2] = {1.6F, 0.4F}, second[2] = {0.4F, 1.6F};
    assert_int_equal(nav_grid_pool_init(&pool, 2, 10), 0);
    struct nav_grid grid = {&pool, &map};
    assert_near(nav_grid_texture(grid, 0.1, 0.1, first), 0.0, 1e-6);
    nav_grid_learn_texture(grid, 0.1, 0.1, first);
    /* 0.8 and 0.2 are believed: 0.8 1.6 + 0.2 0.4, and 0.8 0.4 + 0.2 1.6 */
    assert_near(nav_grid_texture(grid, 0.1, 0.1, first), log(1.36), 1e-6);
    assert_near(nav_grid_texture(grid, 0.1, 0.1, second), log(0.64), 1e-6);
    assert_true(nav_grid_texture(grid, 0.16, 0.1, first) > 0.1); /* beside it, too, but less surely */
    assert_true(nav_grid_texture(grid, 0.16, 0.1, first) < log(1.36));
    nav_grid_pool_free(&pool);
}

/* A gain of 10 % that lasts: 1 m is known to 0.1 m, and the gain follows from where it ended. */
static void test_where_it_ended_tells_the_gain(void **state)
{
    (void)state;
    struct nav_grid_odometry odometry = {.relative = 0.1, .memory_m = 1e9, .drift = 0.01};
    struct nav_grid_gaussian g;
    nav_grid_gaussian_begin(&g, &odometry);
    nav_grid_gaussian_move(&g, &odometry, (struct nav_pose){1.0, 0.0, 0.0}, (struct nav_noise){0.0, 0.0});
    assert_near(g.cov[NAV_GRID_X][NAV_GRID_X], 0.01, 1e-6);
    assert_near(g.cov[NAV_GRID_HEADING][NAV_GRID_HEADING], 0.01, 1e-6);
    nav_grid_gaussian_set(&g, (struct nav_pose){1.05, 0.0, 0.0});
    assert_near(g.mean[NAV_GRID_DISTANCE_GAIN], 0.05, 1e-4);
    assert_near(g.cov[NAV_GRID_DISTANCE_GAIN][NAV_GRID_DISTANCE_GAIN], 0.0, 1e-5);
    assert_near(g.cov[NAV_GRID_TURN_GAIN][NAV_GRID_TURN_GAIN], 0.01, 1e-6);
    nav_grid_gaussian_move(&g, &odometry, (struct nav_pose){1.0, 0.0, 0.0}, (struct nav_noise){0.0, 0.0});
    assert_near(g.mean[NAV_GRID_X], 2.1, 1e-3);
    /* A turn on the spot keeps its error, whose variance grows with the square. */
    nav_grid_gaussian_set(&g, (struct nav_pose){0.0, 0.0, 0.0});
    for (int n = 0; n < 10; n++)
        nav_grid_gaussian_move(&g, &odometry, (struct nav_pose){0.0, 0.0, 0.2}, (struct nav_noise){0.0, 0.0});
    assert_near(g.cov[NAV_GRID_HEADING][NAV_GRID_HEADING], 0.04, 1e-5);
    odometry.turn = 0.003; /* a gyroscope's errors are fresh in every row */
    nav_grid_gaussian_begin(&g, &odometry);
    for (int n = 0; n < 10; n++)
        nav_grid_gaussian_move(&g, &odometry, (struct nav_pose){0.1, 0.0, 0.2}, (struct nav_noise){0.0, 0.0});
    assert_near(g.cov[NAV_GRID_HEADING][NAV_GRID_HEADING], 9e-5, 1e-6);
}

static void test_a_measurement_halves_the_variance(void **state)
{
    (void)state;
    struct nav_grid_odometry odometry = {.relative = 0.1, .memory_m = 1e9};
    static const double along_x[NAV_GRID_POSE] = {1.0, 0.0, 0.0};
    struct nav_grid_gaussian g;
    nav_grid_gaussian_begin(&g, &odometry);
    nav_grid_gaussian_move(&g, &odometry, (struct nav_pose){1.0, 0.0, 0.0}, (struct nav_noise){0.0, 0.0});
    assert_near(nav_grid_gaussian_variance(&g, along_x, 0.01), 0.02, 1e-6);
    nav_grid_gaussian_measure(&g, along_x, 0.2, 0.01);
    assert_near(g.mean[NAV_GRID_X], 1.1, 1e-5);
    assert_near(g.mean[NAV_GRID_DISTANCE_GAIN], 0.1, 1e-5);
    assert_near(g.cov[NAV_GRID_X][NAV_GRID_X], 0.005, 1e-6);
}

static void step(void *mapper, const struct nav_row *row, struct nav_estimate *out)
{
    nav_grid_mapper_step(mapper, row, out);
}

static struct drive drive_begin(const struct nav_problem *p, bool surface)
{
    struct nav_grid_mapper_options options = nav_grid_mapper_default();
    options.surface = surface;
    return (struct drive){.step = step, .mapper = nav_grid_mapper_new(p, &options), .pose = {0.2, 0.0, 0.0}};
}

static void test_a_wall_felt_again_corrects_the_pose(void **state)
{
    (void)state;
    struct nav_problem p = room();
    for (int surface = 0; surface < 2; surface++) {
        static struct nav_mapper_face face[NAV_GRID_FACES_MOST];
        struct drive d = drive_begin(&p, surface == 1);
        for (int bout = 0; bout < 4; bout++)
            drive_bout(&d, bout ? 1.05 : 1.0); /* 3 cm a bout, 9 cm in all, by the wheels */
        for (int n = 0; n < 30; n++)
            drive_step(&d, 0.02, 0.0, 1.0);
        assert_near(d.estimate.pose.x, d.pose.x - 0.2, surface ? 0.03 : 0.05);
        long count = nav_grid_mapper_faces(d.mapper, face, NAV_GRID_FACES_MOST);
        assert_true(count > 0);
        long most = 0;
        for (long n = 1; n < count; n++)
            most = face[n].hits > face[most].hits ? n : most;
        assert_near(face[most].x0, 0.8, 0.05); /* the first pose, at 0.2 m, is the origin */
        nav_grid_mapper_free(d.mapper);
    }
}

static void test_without_contacts_it_becomes_unsure(void **state)
{
    (void)state;
    struct nav_problem p = room();
    struct drive d = drive_begin(&p, true);
    double before = 0.0;
    d.pose.theta = NAV_PI; /* away from the wall */
    for (int n = 0; n < 600; n++) {
        drive_step(&d, 0.02, 0.0, 1.0);
        double now = d.estimate.covariance[0] + d.estimate.covariance[4];
        assert_true(now >= 0.8 * before); /* a hundred draws tell a variance to a seventh */
        before = fmax(now, before);
    }
    assert_true(d.estimate.confidence < 0.5);
    nav_grid_mapper_free(d.mapper);
}

static void test_the_same_seed_gives_the_same_bytes(void **state)
{
    (void)state;
    struct nav_problem p = room();
    struct drive a = drive_begin(&p, true), b = drive_begin(&p, true);
    p.seed++;
    struct drive c = drive_begin(&p, true);
    drive_bout(&a, 1.05);
    drive_bout(&b, 1.05);
    drive_bout(&c, 1.05);
    assert_memory_equal(&a.estimate, &b.estimate, sizeof a.estimate);
    assert_true(a.estimate.pose.x != c.estimate.pose.x);
    nav_grid_mapper_free(a.mapper);
    nav_grid_mapper_free(b.mapper);
    nav_grid_mapper_free(c.mapper);
}

static void test_bad_cells_are_counted_and_not_read(void **state)
{
    (void)state;
    struct nav_problem p = room();
    struct drive d = drive_begin(&p, true);
    double texture[2] = {INFINITY, NAN}, radial = -1.0;
    struct nav_row row = {.t_s = 0.1, .odometry = {NAN, 0.0, 1e9}, .texture = texture, .radial_m = &radial};
    for (int n = 0; n < 100; n++) {
        row.t_s += 0.1;
        nav_grid_mapper_step(d.mapper, &row, &d.estimate);
        assert_true(isfinite(d.estimate.pose.x + d.estimate.pose.y + d.estimate.pose.theta));
    }
    assert_int_equal(nav_grid_mapper_bad_cells(d.mapper), 100 * 5);
    row.t_s = 5.0;
    nav_grid_mapper_step(d.mapper, &row, &d.estimate);
    assert_int_equal(nav_grid_mapper_bad_rows(d.mapper), 1);
    nav_grid_mapper_free(d.mapper);
}

static void test_steps_do_not_allocate_and_memory_has_a_bound(void **state)
{
    (void)state;
    struct nav_problem p = room();
    struct nav_grid_mapper_options options = {.particles = 5000, .surface = true};
    struct drive d = {.step = step, .mapper = nav_grid_mapper_new(&p, &options)};
    drive_step(&d, 0.0, 0.0, 1.0);
    assert_true(d.estimate.bytes > 1000000 && d.estimate.bytes < 256000000);
    nav_grid_mapper_free(d.mapper);
    d = drive_begin(&p, true);
    allocations = 0;
    drive_bout(&d, 1.0);
    assert_int_equal(allocations, 0);
    nav_grid_mapper_free(d.mapper);
    struct nav_grid_mapper *m = NULL;
    for (long fails = 1; !m; fails++) {
        blocks = allocations = 0;
        failed_allocation = fails;
        m = nav_grid_mapper_new(&p, &options);
        failed_allocation = 0;
        assert_true(m || blocks == 0);
    }
    nav_grid_mapper_free(m);
}

static void test_options_have_limits(void **state)
{
    (void)state;
    struct nav_problem p = room();
    assert_null(nav_grid_mapper_new(&p, &(struct nav_grid_mapper_options){.particles = 0}));
    assert_null(nav_grid_mapper_new(&p, &(struct nav_grid_mapper_options){.particles = 5001}));
    nav_grid_mapper_free(NULL);
}

struct reckoned {
    struct nav_grid_path *path;
    struct nav_pose pose;
    double sum, last;
};

static void reckon(void *reckoned, const struct nav_row *row, struct nav_estimate *out)
{
    struct reckoned *r = reckoned;
    r->pose = nav_compose(r->pose, (struct nav_pose){row->odometry[0], row->odometry[1], row->odometry[2]});
    r->last = nav_grid_path_step(r->path, row, &r->pose);
    r->sum += r->last;
    out->pose = r->pose;
}

/* What the wheels report on four ways to the wall and back, as a path. */
static double path_evidence(const struct nav_problem *p, double gain)
{
    struct reckoned r = {.path = nav_grid_path_new(p)};
    struct drive d = {.step = reckon, .mapper = &r, .pose = {0.2, 0.0, 0.0}};
    for (int bout = 0; bout < 4; bout++)
        drive_bout(&d, bout ? gain : 1.0);
    nav_grid_path_free(r.path);
    return r.sum;
}

static void test_a_path_along_which_a_wall_moves_explains_less(void **state)
{
    (void)state;
    struct nav_problem p = room();
    double here = path_evidence(&p, 1.0), little = path_evidence(&p, 1.02), much = path_evidence(&p, 1.05);
    assert_true(here > little + 10.0);
    assert_true(little > much + 10.0);
}

static void test_the_first_row_of_a_path_is_by_the_prior(void **state)
{
    (void)state;
    struct nav_problem p = room();
    struct reckoned r = {.path = nav_grid_path_new(&p)};
    struct drive d = {.step = reckon, .mapper = &r};
    allocations = 0;
    drive_step(&d, 0.02, 0.0, 1.0);
    /* A whisker of eight cells in the open, a cell solid by 0.02. */
    double stopped = (1.0 - p.settings.radial.miss) * 0.02;
    assert_near(r.last, log(1.0 - p.settings.radial.ghost) + 8.0 * log(1.0 - stopped), 1e-6);
    drive_bout(&d, 1.0);
    assert_int_equal(allocations, 0);
    assert_true(nav_grid_path_bytes(r.path) > 1000000 && nav_grid_path_bytes(r.path) < 40000000);
    nav_grid_path_free(r.path);
    r.path = NULL;
    for (long fails = 1; !r.path; fails++) {
        blocks = allocations = 0;
        failed_allocation = fails;
        r.path = nav_grid_path_new(&p);
        failed_allocation = 0;
        assert_true(r.path || blocks == 0);
    }
    nav_grid_path_free(r.path);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_a_copy_shares_until_it_is_written),
        cmocka_unit_test(test_contacts_make_a_surface),
        cmocka_unit_test(test_a_texture_is_expected_where_it_was_read),
        cmocka_unit_test(test_where_it_ended_tells_the_gain),
        cmocka_unit_test(test_a_measurement_halves_the_variance),
        cmocka_unit_test(test_a_wall_felt_again_corrects_the_pose),
        cmocka_unit_test(test_without_contacts_it_becomes_unsure),
        cmocka_unit_test(test_the_same_seed_gives_the_same_bytes),
        cmocka_unit_test(test_bad_cells_are_counted_and_not_read),
        cmocka_unit_test(test_steps_do_not_allocate_and_memory_has_a_bound),
        cmocka_unit_test(test_options_have_limits),
        cmocka_unit_test(test_a_path_along_which_a_wall_moves_explains_less),
        cmocka_unit_test(test_the_first_row_of_a_path_is_by_the_prior),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
