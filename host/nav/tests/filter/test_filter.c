/* Rows in, estimates out: cleaning, order of rows, and every filter against broken rows. */
#include "filter.h"

#include <string.h>

#include "intake.h"
#include "near.h"
#include "rooms.h"

static const double READ[] = {0.0, -20.0}, OTHER[] = {-20.0, 0.0}, NOT_READ[] = {NAN, NAN};

static struct nav_row row_at(double t_s, const double *texture, const double *distance)
{
    return (struct nav_row){.t_s = t_s, .odometry = {0.01, 0.0, 0.0}, .texture = texture, .radial_m = distance};
}

struct taken {
    bool news;
    struct nav_motion motion;
    double weight[2];
};

static struct taken take(struct nav_intake *in, const struct nav_row *row)
{
    struct taken t;
    struct nav_evidence evidence;
    t.news = nav_intake_take(in, row, &t.motion, &evidence);
    memcpy(t.weight, evidence.weight, sizeof t.weight);
    return t;
}

static void readings_count_by_how_far_the_whisker_has_moved(void **state)
{
    (void)state;
    struct nav_problem p = room();
    p.settings.texture.spacing_m = 0.04;
    p.settings.radial.spacing_m = 0.02;
    struct nav_intake in;
    nav_intake_init(&in, &p);
    const double nothing = INFINITY, contact = 0.1;
    struct nav_row row = row_at(0.1, READ, &nothing);
    struct taken t = take(&in, &row);
    assert_near(t.weight[0], 1.0, 0.0); /* the first reading is all new */
    assert_near(t.weight[1], 1.0, 0.0);
    row = row_at(0.2, READ, &nothing);
    t = take(&in, &row);
    assert_near(t.weight[0], 0.25, 1e-12); /* a quarter's path, which takes more away than repeat.h would */
    assert_near(t.weight[1], 0.5, 1e-12);
    row = row_at(0.3, NOT_READ, &contact);
    t = take(&in, &row);
    assert_near(t.weight[0], 0.0, 0.0);
    assert_near(t.weight[1], 1.0, 0.0); /* a change is news at any distance */
    row = row_at(0.4, OTHER, &nothing);
    row.odometry[0] = 0.0;
    t = take(&in, &row);
    assert_near(t.weight[0], 0.25, 1e-12); /* another class; 0.01 m from the row it was not read in */
    nav_intake_free(&in);
}

static void a_repetition_counts_less_at_any_distance(void **state)
{
    (void)state;
    struct nav_problem p = room();
    p.settings.texture.spacing_m = 0.001;
    struct nav_intake in;
    nav_intake_init(&in, &p);
    const double nan = NAN;
    struct nav_row row = row_at(0.1, READ, &nan);
    take(&in, &row);
    row = row_at(0.2, READ, &nan);
    double same = take(&in, &row).weight[0];
    assert_true(same > 0.3 && same < 0.9);
    row = row_at(0.3, OTHER, &nan);
    assert_near(take(&in, &row).weight[0], 1.0, 0.0);
    nav_intake_free(&in);
}

/* Weight of a repetition after many short runs of another class, which a belief expected or not. */
static double weight_after_runs(double expected)
{
    struct nav_problem p = room();
    p.settings.texture.spacing_m = 0.001;
    struct nav_intake in;
    nav_intake_init(&in, &p);
    const double nan = NAN;
    double weight = 0.0;
    for (int k = 0; k < 995; k++) { /* up to the second window of a run */
        struct nav_row row = row_at(0.1 * k, k % 10 < 3 ? OTHER : READ, &nan);
        struct nav_motion motion;
        struct nav_evidence evidence;
        assert_true(nav_intake_take(&in, &row, &motion, &evidence));
        weight = evidence.weight[0];
        assert_near(evidence.track[0].expected, 0.0, 0.0); /* of the row before: it counts once */
        evidence.track[0].expected = expected;
    }
    nav_intake_free(&in);
    return weight;
}

static void runs_that_the_belief_expected_are_no_errors(void **state)
{
    (void)state;
    double errors = weight_after_runs(0.0), tiles = weight_after_runs(1.0);
    assert_true(errors < 0.5 * tiles);
}

static void turning_moves_a_whisker_by_its_lever(void **state)
{
    (void)state;
    struct nav_problem p = room();
    p.settings.texture.spacing_m = 0.04;
    struct nav_intake in;
    nav_intake_init(&in, &p);
    const double nan = NAN;
    struct nav_row row = row_at(0.1, READ, &nan);
    take(&in, &row);
    row = row_at(0.2, OTHER, &nan);
    row.odometry[0] = 0.0;
    row.odometry[2] = -0.1;
    assert_near(take(&in, &row).weight[0], 0.1 * 0.1 / 0.04, 1e-12);
    nav_intake_free(&in);
}

static void bad_cells_are_counted_and_not_read(void **state)
{
    (void)state;
    struct nav_problem p = room();
    struct nav_intake in;
    nav_intake_init(&in, &p);
    const double infinite[] = {0.0, -INFINITY}, far = 0.5, negative = -0.01, nan = NAN;
    struct nav_row row = row_at(0.1, infinite, &far);
    assert_false(take(&in, &row).news);
    assert_int_equal(in.bad_cells, 2);
    row = row_at(0.2, NOT_READ, &negative);
    assert_false(take(&in, &row).news);
    assert_int_equal(in.bad_cells, 3);
    row = row_at(0.3, NOT_READ, &nan); /* not read is not bad */
    assert_false(take(&in, &row).news);
    assert_int_equal(in.bad_cells, 3);
    row = row_at(NAN, NOT_READ, &nan);
    row.odometry[1] = 7.0;
    struct taken t = take(&in, &row);
    assert_int_equal(in.bad_cells, 5);
    assert_near(t.motion.step.x, 0.0, 0.0);
    assert_true(t.motion.unknown_m > 0.0); /* it drove before: how far now is not known */
    assert_int_equal(in.bad_rows, 0);
    nav_intake_free(&in);
}

static void a_window_that_favours_no_texture_is_not_read(void **state)
{
    (void)state;
    struct nav_problem p = room();
    struct nav_intake in;
    nav_intake_init(&in, &p);
    const double zero[] = {0.0, 0.0}, constant[] = {-512.5, -512.5}, nan = NAN;
    struct nav_row row = row_at(0.1, zero, &nan);
    assert_false(take(&in, &row).news);
    row = row_at(0.2, constant, &nan);
    assert_false(take(&in, &row).news);
    row = row_at(0.3, READ, &nan);
    assert_near(take(&in, &row).weight[0], 1.0, 0.0); /* nothing was used up */
    assert_int_equal(in.empty, 2);
    assert_int_equal(in.bad_cells, 0);
    nav_intake_free(&in);
}

static void odometry_is_never_taken_twice_nor_dropped(void **state)
{
    (void)state;
    struct nav_problem p = room();
    struct nav_intake in;
    nav_intake_init(&in, &p);
    const double nothing = INFINITY;
    const double times[] = {0.1, 0.2, 0.2, 0.4, 0.3, 0.5};
    double x = 0.0;
    bool news[6];
    for (int i = 0; i < 6; i++) {
        struct nav_row row = row_at(times[i], READ, &nothing);
        struct taken t = take(&in, &row);
        news[i] = t.news;
        x += t.motion.step.x;
        assert_true((t.motion.unknown_m > 0.0) == (i == 3)); /* when 0.4 comes, 0.3 is missing */
    }
    assert_near(x, 0.05, 1e-12);
    assert_int_equal(in.bad_rows, 2);
    assert_true(news[1] && !news[2] && news[3] && !news[4] && news[5]);
    nav_intake_free(&in);
}

/* Sums of the motion of rows that drive 10 mm and a little each, of which no two are alike. */
static struct nav_motion taken_at(const double *times, int count, uint64_t *bad_rows, int *read)
{
    struct nav_problem p = room();
    struct nav_intake in;
    nav_intake_init(&in, &p);
    const double nothing = INFINITY;
    struct nav_motion sum = {.unknown_m = 0.0};
    *read = 0;
    for (int i = 0; i < count; i++) {
        struct nav_row row = row_at(times[i], READ, &nothing);
        row.odometry[1] = 1e-9 * i;
        struct taken t = take(&in, &row);
        *read += t.news;
        sum.step.x += t.motion.step.x;
        sum.unknown_m += t.motion.unknown_m;
    }
    *bad_rows = in.bad_rows;
    nav_intake_free(&in);
    return sum;
}

static void motion_counts_whatever_the_stamp_is(void **state)
{
    (void)state;
    static const struct {
        double times[8];
        int read;
    } clocks[] = {
        {{0, 0, 0, 0, 0, 0, 0, 0}, 1},                    /* stands */
        {{0.2, 0.2, 0.4, 0.4, 0.6, 0.6, 0.8, 0.8}, 4},    /* of a coarse step: nothing is missing between its steps */
        {{1, 1, 1, 1, 1, 1, 1.5, 1.6}, 3},                /* the same, six to a step */
        {{0.1, 0.2, NAN, 0.4, NAN, NAN, 0.7, 0.8}, 8},    /* without a stamp now and then */
        {{5.1, 5.2, 5.3, 0.4, 0.5, 0.6, 0.7, 0.8}, 3},    /* set back */
        {{0.1, 0.2, 0.4, 0.3, 0.3, 0.5, 0.6, 0.7}, 6},    /* two late with one stamp */
        {{NAN, NAN, NAN, NAN, NAN, NAN, NAN, NAN}, 8},    /* none */
        {{-5.0, -4.9, -4.8, 0.0, 0.1, 0.2, 0.3, 0.4}, 8}, /* a jump ahead: nobody knows what was in it */
    };
    for (size_t n = 0; n < sizeof clocks / sizeof clocks[0]; n++) {
        uint64_t bad;
        int read;
        struct nav_motion sum = taken_at(clocks[n].times, 8, &bad, &read);
        assert_near(sum.step.x, 0.08, 1e-12);
        assert_int_equal(read, clocks[n].read);
        assert_int_equal(bad, 8 - read);
        assert_true((sum.unknown_m > 1e-6) == (n == 5 || n == 7)); /* where rows were missing for a while */
    }
}

static void every_filter_is_listed_and_no_other_name_is_taken(void **state)
{
    (void)state;
    struct nav_problem p = room();
    int count = 0;
    for (; nav_filter_name(count); count++) {
        struct nav_filter *f = nav_filter_new(nav_filter_name(count), &p);
        assert_non_null(f);
        nav_filter_free(f);
    }
    assert_in_range(count, 3, 100);
    assert_null(nav_filter_new("crystal ball", &p));
}

static void assert_sane(const struct nav_estimate *e)
{
    assert_true(isfinite(e->pose.x) && isfinite(e->pose.y) && fabs(e->pose.theta) <= NAV_PI + 1e-9);
    assert_true(e->confidence >= 0.0 && e->confidence <= 1.0);
    for (int i = 0; i < 9; i++)
        assert_true(isfinite(e->covariance[i]));
    assert_true(e->covariance[0] > 0.0 && e->covariance[4] > 0.0 && e->covariance[8] > 0.0);
}

static void no_row_makes_any_filter_say_nonsense(void **state)
{
    (void)state;
    struct nav_problem p = room();
    const double odd[] = {NAN, INFINITY, -INFINITY, 0.0, 1e300, -1e300, 1e-300, 0.1, -0.1};
    enum { ODD = sizeof odd / sizeof odd[0] };
    for (int n = 0; nav_filter_name(n); n++) {
        struct nav_filter *f = nav_filter_new(nav_filter_name(n), &p);
        unsigned random = 12345;
        for (int i = 0; i < 400; i++) {
            double pick[7];
            for (int k = 0; k < 7; k++) {
                random = random * 1664525u + 1013904223u;
                pick[k] = odd[(random >> 16) % ODD];
            }
            struct nav_row row = {
                .t_s = pick[0], .odometry = {pick[1], pick[2], pick[3]}, .texture = &pick[4], .radial_m = &pick[6]};
            struct nav_estimate e;
            nav_filter_step(f, &row, &e);
            assert_sane(&e);
        }
        assert_true(nav_filter_bad_cells(f) > 100 && nav_filter_bad_rows(f) > 100);
        nav_filter_free(f);
    }
}

static void nothing_read_makes_no_filter_surer(void **state)
{
    (void)state;
    struct nav_problem p = room();
    const double nan = NAN;
    for (int n = 0; nav_filter_name(n); n++) {
        struct nav_filter *f = nav_filter_new(nav_filter_name(n), &p);
        struct nav_estimate e, before = {.covariance = {0}};
        for (int i = 0; i < 50; i++) {
            struct nav_row row = row_at(0.1 * i, NOT_READ, &nan);
            row.odometry[0] = i % 2 ? 0.02 : -0.02;
            nav_filter_step(f, &row, &e);
            assert_true(e.covariance[8] >= before.covariance[8]);
            assert_int_equal(e.evaluations, 0);
            before = e;
        }
        nav_filter_free(f);
    }
}

/* Rows that carry no information (unreadable, constant, repeated, late) after rows that did. */
static void rows_without_information_make_no_filter_surer(void **state)
{
    (void)state;
    struct nav_problem p = room();
    const double wide[] = {INFINITY, -INFINITY}, zero[] = {0.0, 0.0}, half[] = {0.0, NAN}, none = (double)INFINITY;
    const double *const useless[] = {NOT_READ, wide, zero, half};
    const double nan = NAN, below = -3.0, beyond = 7.0, *const odd[] = {&nan, &below, &beyond};
    for (int n = 0; nav_filter_name(n); n++) {
        struct nav_filter *f = nav_filter_new(nav_filter_name(n), &p);
        struct nav_estimate e, before;
        for (int i = 0; i < 5; i++) {
            struct nav_row row = row_at(0.1 * i, READ, &none);
            nav_filter_step(f, &row, &before);
        }
        for (int i = 0; i < 60; i++) {
            /* Every fourth row comes from the past and does carry readings. */
            bool late = i % 4 == 3;
            struct nav_row row =
                row_at(late ? 0.05 : 1.0 + 0.1 * i, late ? READ : useless[i % 4], late ? &none : odd[i % 3]);
            row.odometry[0] = i % 2 ? 0.02 : NAN;
            nav_filter_step(f, &row, &e);
            assert_sane(&e);
            /* A cloud's moments wander a little when noise is drawn. */
            assert_true(e.covariance[0] + e.covariance[4] >= 0.99 * (before.covariance[0] + before.covariance[4]));
            assert_true(e.covariance[8] >= 0.99 * before.covariance[8]);
            assert_true(e.confidence <= before.confidence + 0.01);
            before = e;
        }
        nav_filter_free(f);
    }
}

/* Moments of the listed belief about the estimate. */
static void components_are_the_belief(void **state)
{
    (void)state;
    enum { ROOM = 40000 };
    static struct nav_component component[ROOM];
    struct nav_problem p = room();
    p.prior.mean.theta = 3.0;
    p.robot.body_radius = 0.01;
    const double nan = NAN;
    for (int n = 0; nav_filter_name(n); n++) {
        struct nav_filter *f = nav_filter_new(nav_filter_name(n), &p);
        struct nav_row row = row_at(0.1, NOT_READ, &nan);
        struct nav_estimate e;
        nav_filter_step(f, &row, &e);
        long count = nav_filter_components(f, component, ROOM);
        double mass = 0.0, x = 0.0, xx = 0.0, tt = 0.0;
        assert_in_range(count, 1, ROOM);
        for (long i = 0; i < count; i++) {
            double dx = component[i].pose.x - e.pose.x, turn = nav_wrap(component[i].pose.theta - e.pose.theta);
            mass += component[i].mass;
            x += component[i].mass * dx;
            xx += component[i].mass * (dx * dx + component[i].sigma_m * component[i].sigma_m);
            tt += component[i].mass * (turn * turn + component[i].sigma_rad * component[i].sigma_rad);
        }
        assert_near(mass, 1.0, 1e-4);
        assert_near(x, 0.0, 0.01);
        assert_near(sqrt(xx), sqrt(e.covariance[0]), 0.005);
        assert_near(sqrt(tt), sqrt(e.covariance[8]), 0.01);
        /* Without room for all of them it lists the first ones and touches nothing beyond. */
        const struct nav_component untouched = {{7.0, 7.0, 7.0}, 7.0, 7.0, 7.0};
        for (long i = 0; i < ROOM; i++)
            component[i] = untouched;
        assert_int_equal(nav_filter_components(f, component, 1), count);
        assert_memory_not_equal(&component[0], &untouched, sizeof untouched);
        for (long i = 1; i < ROOM; i++)
            assert_memory_equal(&component[i], &untouched, sizeof untouched);
        nav_filter_free(f);
    }
}

static void the_callers_arrays_may_go_after_creation(void **state)
{
    (void)state;
    struct nav_problem p = room();
    uint8_t floor[4];
    struct nav_tip tip = ROOM_TIP[0];
    memcpy(floor, ROOM_FLOOR, sizeof floor);
    p.arena.floor = floor;
    p.robot.tip = &tip;
    struct nav_filter *kept = nav_filter_new("foveal", &p);
    memset(floor, 1, sizeof floor);
    tip.x = 1e9;
    struct nav_problem fresh = room();
    struct nav_filter *reference = nav_filter_new("foveal", &fresh);
    const double nothing = INFINITY;
    struct nav_row row = row_at(0.1, READ, &nothing);
    struct nav_estimate a, b;
    nav_filter_step(kept, &row, &a);
    nav_filter_step(reference, &row, &b);
    assert_memory_equal(&a.pose, &b.pose, sizeof a.pose);
    nav_filter_free(kept);
    nav_filter_free(reference);
}

static void settings_are_set_by_name_and_within_their_range(void **state)
{
    (void)state;
    struct nav_settings s;
    nav_settings_default(&s);
    assert_near(s.foveal.cells, 11.0, 0.0);
    assert_int_equal(nav_settings_set(&s, "grid.cell_m", 0.1), 0);
    assert_near(s.grid.cell_m, 0.1, 0.0);
    assert_int_equal(nav_settings_set(&s, "grid.cell_m", -0.1), -2);
    assert_int_equal(nav_settings_set(&s, "grid.cell_m", NAN), -2);
    assert_int_equal(nav_settings_set(&s, "grid.cell", 0.1), -1);
    assert_near(s.grid.cell_m, 0.1, 0.0);
    const char *name;
    double standard, low, high;
    int count = 0;
    for (; nav_settings_describe(count, &name, &standard, &low, &high) == 0; count++)
        assert_int_equal(nav_settings_set(&s, name, standard), 0);
    assert_int_equal(count, sizeof s / sizeof(double)); /* every field has a name */
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(readings_count_by_how_far_the_whisker_has_moved),
        cmocka_unit_test(a_repetition_counts_less_at_any_distance),
        cmocka_unit_test(runs_that_the_belief_expected_are_no_errors),
        cmocka_unit_test(turning_moves_a_whisker_by_its_lever),
        cmocka_unit_test(bad_cells_are_counted_and_not_read),
        cmocka_unit_test(a_window_that_favours_no_texture_is_not_read),
        cmocka_unit_test(odometry_is_never_taken_twice_nor_dropped),
        cmocka_unit_test(motion_counts_whatever_the_stamp_is),
        cmocka_unit_test(every_filter_is_listed_and_no_other_name_is_taken),
        cmocka_unit_test(no_row_makes_any_filter_say_nonsense),
        cmocka_unit_test(nothing_read_makes_no_filter_surer),
        cmocka_unit_test(rows_without_information_make_no_filter_surer),
        cmocka_unit_test(components_are_the_belief),
        cmocka_unit_test(the_callers_arrays_may_go_after_creation),
        cmocka_unit_test(settings_are_set_by_name_and_within_their_range),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
