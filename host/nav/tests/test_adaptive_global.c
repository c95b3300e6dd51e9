/* The adaptive filter's histogram by itself: what a job passes over and counts, the noise that it is told, and mass
 * that is neither lost nor worked out twice; and what the log of rows that it reads takes. */
#include "adaptive_global.h"

#include "near.h"
#include "wander.h"

enum { WHISKERS = WANDER_TIPS + WANDER_RAYS, JOB = 10000 /* for a job's beginning and end */, PLENTY = 1000000 };

static const struct nav_noise NO_NOISE = {0.0, 0.0};
static const uint8_t PLAIN[16] = {0};

struct belief {
    struct nav_problem problem;
    struct adaptive_global g;
    struct adaptive_log log;
};

/* Uniform over an arena with one texture everywhere, for a robot so small that it can stand in every cell. */
static void begin(struct belief *b)
{
    b->problem = wander_new(0).problem;
    b->problem.arena.floor = PLAIN;
    b->problem.arena.boxes = 0;
    b->problem.robot.body_radius = 0.01;
    assert_int_equal(adaptive_global_init(&b->g, &b->problem), 0);
    assert_int_equal(adaptive_log_init(&b->log, &b->g.likelihood->sensors), 0);
}

static void end(struct belief *b)
{
    adaptive_global_free(&b->g);
    adaptive_log_free(&b->log);
}

/* The belief as a list of cells: none yet. */
static void empty(struct belief *b)
{
    b->g.fresh = false;
    b->g.total = 0.0;
}

/* Puts mass into `count` cells of a line, from cell i on. */
static void put(struct belief *b, int p, int j, int i, int count, float each)
{
    struct adaptive_span *span = &b->g.span[p * b->g.ny + j];
    int last = i + count + NAV_LANES - 1;
    *span = (struct adaptive_span){i - i % NAV_LANES, last - last % NAV_LANES};
    for (int k = i; k < i + count; k++)
        adaptive_global_line(&b->g, b->g.mass, p, j)[k] = each;
    b->g.total += count * (double)each;
}

/* A row of a robot that stands. texture: what both tips say, NULL: nothing is read. */
static void write(struct belief *b, struct nav_noise noise, const double *texture)
{
    const double nowhere = INFINITY;
    const double *reading[WHISKERS] = {texture, texture, &nowhere, &nowhere, &nowhere};
    const double weight[WHISKERS] = {texture != NULL, texture != NULL};
    adaptive_log_write(&b->log, (struct nav_pose){0.0, 0.0, 0.0}, noise, &(struct nav_evidence){reading, weight});
}

static void work(struct belief *b, long budget)
{
    adaptive_global_work(&b->g, &b->log, budget);
}

static void slices_of_a_uniform_belief_are_done_as_far_as_the_budget_goes(void **state)
{
    (void)state;
    struct belief b;
    begin(&b);
    write(&b, NO_NOISE, NULL);
    long slice = 2L * b.g.ny * b.g.pitch, budget = JOB + 3 * slice + slice / 2;
    work(&b, budget);
    assert_true(b.g.job.running && b.g.job.slice == 3);
    assert_int_equal(b.g.touched, JOB + 3 * slice);
    end(&b);
}

/* Three cells for blurred headings, two for weighing and one for counting what is worth a hypothesis: all of them in
 * the lanes that hold mass, of the slice that does and the two beside it. */
static void a_job_passes_over_what_holds_mass_and_nothing_else(void **state)
{
    (void)state;
    struct belief b;
    begin(&b);
    empty(&b);
    put(&b, 5, 20, 2 * NAV_LANES, NAV_LANES, 1.0f / NAV_LANES);
    write(&b, (struct nav_noise){0.0, 0.1 * b.g.cell_theta * b.g.cell_theta}, NULL);
    work(&b, PLENTY);
    assert_true(adaptive_global_current(&b.g, &b.log));
    assert_int_equal(b.g.touched, JOB + (3 + 2 + 1) * 3 * NAV_LANES);
    end(&b);
}

static void a_belief_spreads_by_the_noise_that_it_is_told(void **state)
{
    (void)state;
    enum { ROWS = 6 };
    struct belief b;
    begin(&b);
    empty(&b);
    put(&b, 5, 20, 20, 1, 1.0f);
    double cell = b.g.cell * b.g.cell, width = b.g.cell_theta * b.g.cell_theta;
    for (int k = 0; k < ROWS; k++) {
        write(&b, (struct nav_noise){0.3 * cell, 0.1 * width}, NULL);
        work(&b, PLENTY);
    }
    const double *covariance = b.g.summary.belief.covariance;
    /* What a cell itself covers, the noise, and what little is still owed. */
    assert_near(covariance[0] / cell, 1.0 / 12.0 + ROWS * 0.3, 0.05);
    assert_near(covariance[4] / cell, 1.0 / 12.0 + ROWS * 0.3, 0.05);
    assert_near(covariance[8] / width, 1.0 / 12.0 + ROWS * 0.1, 0.05);
    end(&b);
}

static void mass_along_the_walls_stays(void **state)
{
    (void)state;
    struct belief b;
    begin(&b);
    empty(&b);
    int last = b.g.ny - 1;
    put(&b, 5, 0, 20, 1, 0.5f);
    put(&b, 5, last, 20, 1, 0.5f);
    write(&b, NO_NOISE, NULL);
    work(&b, PLENTY);
    assert_near((double)adaptive_global_line(&b.g, b.g.mass, 5, 0)[20], 0.5, 1e-6);
    assert_near((double)adaptive_global_line(&b.g, b.g.mass, 5, last)[20], 0.5, 1e-6);
    end(&b);
}

/* Half of the mass in one cell, half in thousands; a row that fits all of them alike, badly, changes no share. */
static void what_is_scattered_is_a_share_of_the_mass(void **state)
{
    (void)state;
    const double wrong[WANDER_CLASSES] = {log(0.075), log(0.85), log(0.075)};
    struct belief b;
    begin(&b);
    empty(&b);
    for (int p = 0; p < b.g.nh; p++) {
        for (int j = 10; j < 20; j++)
            put(&b, p, j, 10, 20, 0.5f / (float)(b.g.nh * 10 * 20));
    }
    put(&b, 5, 30, 30, 1, 0.5f);
    write(&b, NO_NOISE, wrong);
    work(&b, PLENTY);
    assert_true(adaptive_global_current(&b.g, &b.log) && b.g.total < 0.5);
    assert_near(b.g.scattered, 0.5, 1e-3);
    assert_near(b.g.crowd, 1.0, 0.0);
    end(&b);
}

/* Cells that expect the same ask for one likelihood, even when it is so small that a float holds 0. */
static void an_impossible_likelihood_is_worked_out_once(void **state)
{
    (void)state;
    const double wrong[WANDER_CLASSES] = {log(0.075), log(0.85), log(0.075)};
    struct belief b;
    begin(&b);
    empty(&b);
    put(&b, 5, 20, 16, NAV_LANES, 1.0f / NAV_LANES);
    for (int k = 0; k < ADAPTIVE_ROWS_LATE; k++)
        write(&b, NO_NOISE, wrong);
    work(&b, PLENTY);
    assert_true(adaptive_global_current(&b.g, &b.log) && b.g.fresh); /* nothing was left to believe */
    assert_int_equal(b.g.distinct, 1);
    end(&b);
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
        cmocka_unit_test(slices_of_a_uniform_belief_are_done_as_far_as_the_budget_goes),
        cmocka_unit_test(a_job_passes_over_what_holds_mass_and_nothing_else),
        cmocka_unit_test(a_belief_spreads_by_the_noise_that_it_is_told),
        cmocka_unit_test(mass_along_the_walls_stays),
        cmocka_unit_test(what_is_scattered_is_a_share_of_the_mass),
        cmocka_unit_test(an_impossible_likelihood_is_worked_out_once),
        cmocka_unit_test(the_log_counts_the_memory_of_all_rows_kept),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
