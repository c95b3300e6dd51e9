/* The adaptive filter's histogram by itself: what a job passes over and counts, coarse cells that become finer, mass
 * that is neither lost nor worked out twice; and what the log of rows that it reads takes. */
#include "adaptive_global.h"

#include "near.h"
#include "wander.h"

enum { WHISKERS = WANDER_TIPS + WANDER_RAYS };

static const struct nav_noise NO_NOISE = {0.0, 0.0};
static const uint8_t PLAIN[16] = {0};

struct belief {
    struct nav_problem problem;
    struct adaptive_global g;
    struct adaptive_log log;
};

/* Uniform over an arena of so many metres with one texture everywhere, for a robot so small that it can stand in every
 * cell. */
static void begin(struct belief *b, double size)
{
    b->problem = wander_new(0).problem;
    b->problem.arena.floor = PLAIN;
    b->problem.arena.boxes = 0;
    b->problem.arena.size_x = b->problem.arena.size_y = size;
    b->problem.robot.body_radius = 0.01;
    assert_int_equal(adaptive_global_init(&b->g, &b->problem, &(struct nav_ground){.open = 1.0}), 0);
    assert_int_equal(adaptive_log_init(&b->log, &b->g.likelihood->sensors), 0);
}

static void end(struct belief *b)
{
    adaptive_global_free(&b->g);
    adaptive_log_free(&b->log);
}

/* A row of a robot that stands. texture: what both tips say, NULL: nothing is read. */
static void write(struct belief *b, struct nav_noise noise, const double *texture)
{
    const double nowhere = INFINITY;
    const double *reading[WHISKERS] = {texture, texture, &nowhere, &nowhere, &nowhere};
    const double weight[WHISKERS] = {texture != NULL, texture != NULL}, unknown[WHISKERS] = {0.0};
    adaptive_log_write(&b->log, (struct nav_pose){0.0, 0.0, 0.0}, noise,
                       &(struct nav_evidence){.reading = reading, .weight = weight}, unknown);
}

static void work(struct belief *b)
{
    adaptive_global_work(&b->g, &b->log, 0.0);
}

/* A belief in few cells costs no more than these, however large the arena. */
static void a_job_passes_over_what_holds_mass_and_nothing_else(void **state)
{
    (void)state;
    struct belief b;
    begin(&b, 2.0);
    adaptive_global_clear(&b.g, 0);
    adaptive_global_add(&b.g, (struct nav_pose){1.01, 1.01, 0.3}, 1.0);
    adaptive_global_added(&b.g);
    write(&b, (struct nav_noise){0.0, 0.1 * b.g.histogram.shape.cell_theta * b.g.histogram.shape.cell_theta}, NULL);
    work(&b);
    assert_true(adaptive_global_current(&b.g, &b.log));
    assert_int_equal(b.g.histogram.cells, 3);
    /* Three slices take from three groups between them each, pass over one and weigh it. */
    assert_in_range(b.g.touched, 1, (7 + 3 * 2) * NAV_LANES);
    end(&b);
}

/* While the belief is wide, rows wait: none begins a further pass over the arena than fits, and all are caught up with.
 */
static void rows_wait_while_the_belief_is_wide(void **state)
{
    (void)state;
    struct belief b;
    begin(&b, 2.5);
    long each = (long)nav_shape_cells(&b.g.histogram.shape) * 2;
    for (int k = 0; k < 20; k++) {
        const double reading[WANDER_CLASSES] = {0.0, -1.0, -1.0};
        write(&b, NO_NOISE, reading);
        b.log.entry[b.log.head - 1].sharp = true; /* each row is a job */
    }
    int rows = 0;
    for (; !adaptive_global_current(&b.g, &b.log); rows++) {
        work(&b);
        assert_in_range(b.g.touched, 1, 500000 + each);
    }
    assert_in_range(rows, 2, 20);
    end(&b);
}

/* However large the arena, its first pass fits a row, or cells are as wide as the tiles allow; it says so, and its
 * memory stays. */
static void large_arenas_begin_in_wide_cells(void **state)
{
    (void)state;
    struct belief b;
    begin(&b, 2.0);
    assert_near(b.g.first.too_wide, 0.0, 0.0);
    end(&b);
    begin(&b, 60.0);
    assert_true(adaptive_global_bytes(&b.g) < 64e6);
    assert_near(b.g.first.too_wide, b.g.histogram.shape.cell, 0.0); /* above half a tile: it says so */
    assert_true(b.g.first.too_wide > 0.25);
    end(&b);
}

/* A belief that is all there is, and sure of one place, is given the chance of a kidnap, some rows' at once. */
static void a_robot_may_be_carried_while_nothing_else_is_held(void **state)
{
    (void)state;
    const double hazard = 1e-3;
    struct belief b;
    begin(&b, 2.0);
    adaptive_global_clear(&b.g, 0);
    adaptive_global_add(&b.g, (struct nav_pose){1.01, 1.01, 0.3}, 1.0);
    adaptive_global_added(&b.g);
    for (int k = 1; k <= NAV_HAZARD_ROWS; k++) {
        assert_int_equal(b.g.histogram.cells, k > 1 ? 1 : b.g.histogram.cells);
        write(&b, NO_NOISE, NULL);
        adaptive_global_work(&b.g, &b.log, hazard);
    }
    double all = nav_shape_inside(&b.g.histogram.shape);
    assert_near((double)b.g.histogram.cells, all, 0.0);
    assert_near(1.0 - (double)b.g.histogram.heaviest / b.g.histogram.total, NAV_HAZARD_ROWS * hazard, 1e-3);
    end(&b);
}

/* Half of the mass in one cell, half in thousands. */
static void what_is_scattered_is_a_share_of_the_mass(void **state)
{
    (void)state;
    enum { CELLS = 1900 };
    struct belief b;
    begin(&b, 2.0);
    adaptive_global_clear(&b.g, 0);
    for (int n = 0; n < CELLS; n++)
        adaptive_global_add(&b.g, (struct nav_pose){0.5 + n % 19 * 0.05, 0.51, n / 19 * 0.06}, 0.1 / CELLS);
    for (int n = 0; n < 90; n++)
        adaptive_global_add(&b.g, (struct nav_pose){1.01, 1.51, 0.3}, 0.9 / 90);
    adaptive_global_added(&b.g);
    write(&b, NO_NOISE, NULL);
    work(&b);
    assert_true(adaptive_global_current(&b.g, &b.log));
    assert_near(b.g.scattered, 0.1, 0.02);
    assert_in_range((long)b.g.crowd, 1, 40);
    end(&b);
}

/* Cells that expect the same ask for one likelihood, even when it is so small that a float holds 0. */
static void an_impossible_likelihood_is_worked_out_once(void **state)
{
    (void)state;
    const double wrong[WANDER_CLASSES] = {log(0.075), log(0.85), log(0.075)};
    struct belief b;
    begin(&b, 2.0);
    nav_histogram_clear(&b.g.histogram, b.g.first.level);
    adaptive_global_add(&b.g, (struct nav_pose){1.01, 1.01, 0.3}, 1.0);
    adaptive_global_added(&b.g);
    for (int k = 0; k < ADAPTIVE_ROWS_LATE; k++)
        write(&b, NO_NOISE, wrong);
    work(&b);
    assert_true(adaptive_global_current(&b.g, &b.log) && b.g.histogram.uniform); /* nothing was left to believe */
    assert_int_equal(b.g.distinct, 1);
    end(&b);
}

/* An arena of 16 m begins in coarse cells; mass in a few of them is divided, and no hypothesis is drawn before. */
static void coarse_cells_are_refined_where_mass_is(void **state)
{
    (void)state;
    struct belief b;
    begin(&b, 16.0);
    assert_true(b.g.first.level > 0 && b.g.histogram.level == b.g.first.level);
    assert_near(b.g.histogram.levels.cell, b.g.cell.edge, 0.0);
    nav_histogram_clear(&b.g.histogram, b.g.first.level);
    adaptive_global_add(&b.g, (struct nav_pose){8.01, 8.01, 0.3}, 1.0);
    adaptive_global_added(&b.g);
    for (int level = b.g.first.level; level > 0; level--) {
        assert_near(b.g.scattered, 1.0, 0.0);
        write(&b, NO_NOISE, NULL);
        work(&b);
        assert_int_equal(b.g.histogram.level, level - 1);
    }
    write(&b, NO_NOISE, NULL);
    work(&b);
    assert_near(b.g.histogram.shape.cell, b.g.cell.edge, 1e-12);
    assert_true(b.g.scattered < 0.5 && b.g.summary.mass > 0.5);
    end(&b);
}

/* What finer cells expect is worked out pose by pose: the same as the table of the first level gives. */
static void cells_without_a_table_are_weighed_as_those_with_one(void **state)
{
    (void)state;
    const double texture[WANDER_CLASSES] = {log(0.85), log(0.075), log(0.075)};
    struct belief belief[2];
    for (int n = 0; n < 2; n++) {
        struct belief *b = &belief[n];
        b->problem = wander_new(0).problem;
        assert_int_equal(adaptive_global_init(&b->g, &b->problem, &(struct nav_ground){.open = 1.0}), 0);
        assert_int_equal(adaptive_log_init(&b->log, &b->g.likelihood->sensors), 0);
        b->g.first.level = n; /* the second takes its cells, those of level 0, for finer than the table's */
        write(b, NO_NOISE, texture);
        work(b);
    }
    const struct nav_histogram *with = &belief[0].g.histogram, *without = &belief[1].g.histogram;
    assert_int_equal(nav_histogram_groups(with), nav_histogram_groups(without));
    for (size_t n = 0; n < nav_histogram_groups(with) * (size_t)NAV_LANES; n++)
        assert_near((double)with->now.mass[n] / (double)with->heaviest,
                    (double)without->now.mass[n] / (double)with->heaviest, 1e-5);
    assert_int_equal(belief[1].g.distinct, 0);
    end(&belief[0]);
    end(&belief[1]);
}

static size_t log_bytes(int classes)
{
    struct adaptive_log log;
    struct nav_problem problem = wander_new(0).problem;
    problem.arena.classes = classes;
    struct nav_sensors sensors;
    assert_int_equal(nav_sensors_init(&sensors, &problem.arena, &problem.robot, &problem.settings, 0.0), 0);
    assert_int_equal(adaptive_log_init(&log, &sensors), 0);
    size_t bytes = adaptive_log_bytes(&log);
    adaptive_log_free(&log);
    nav_sensors_free(&sensors);
    return bytes;
}

static void the_log_counts_the_memory_of_all_rows_kept(void **state)
{
    (void)state;
    const size_t more = ADAPTIVE_ROWS_KEPT * WANDER_TIPS * sizeof(double); /* for every class */
    assert_int_equal(log_bytes(8) - log_bytes(3), 5 * more);
    assert_true(log_bytes(3) > 3 * more + ADAPTIVE_ROWS_KEPT * WHISKERS * sizeof(double));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_job_passes_over_what_holds_mass_and_nothing_else),
        cmocka_unit_test(rows_wait_while_the_belief_is_wide),
        cmocka_unit_test(large_arenas_begin_in_wide_cells),
        cmocka_unit_test(a_robot_may_be_carried_while_nothing_else_is_held),
        cmocka_unit_test(what_is_scattered_is_a_share_of_the_mass),
        cmocka_unit_test(an_impossible_likelihood_is_worked_out_once),
        cmocka_unit_test(coarse_cells_are_refined_where_mass_is),
        cmocka_unit_test(cells_without_a_table_are_weighed_as_those_with_one),
        cmocka_unit_test(the_log_counts_the_memory_of_all_rows_kept),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
