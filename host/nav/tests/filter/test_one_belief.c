/* Pose, covariance and confidence of every filter, in every state, against the belief that it lists: draws from its
 * components are counted within 0.25 m and 0.5 rad of its pose, and the components' spread about it is taken. */
#include "filter.h"

#include <stdlib.h>
#include <string.h>

#include "near.h"
#include "wander.h"

enum { DRAWS = 20000, FILTERS = 6, LISTED_MOST = 400000 };
static const double LARGEST = 0.02, KERNEL = 1.4, FINEST_M = 0.003; /* of components: see `judge` */

static const double NOT_READ_TEXTURE[WANDER_TIPS * WANDER_CLASSES] = {NAN, NAN, NAN, NAN, NAN, NAN};
static const double NOT_READ_RADIAL[WANDER_RAYS] = {NAN, NAN, NAN};

struct tried {
    const char *name;
    struct wander w;
    struct nav_filter *filter;
    struct nav_estimate e;
    struct nav_rng rng;       /* of the draws */
    double t_s, worst, ratio; /* the ratio of spreads that is furthest from 1 */
};

struct counted {
    double near, spread; /* share of the draws near the pose; root of the mean squared distance from it, m */
};

/* Draws are systematic over components, and normal within one. */
static struct counted count(struct tried *t)
{
    static struct nav_component c[LISTED_MOST];
    long n = nav_filter_components(t->filter, c, LISTED_MOST), near = 0, i = 0;
    double passed = c[0].mass, square = 0.0;
    assert_in_range(n, 1, LISTED_MOST);
    for (int k = 0; k < DRAWS; k++) {
        while ((k + 0.5) / DRAWS > passed && i + 1 < n)
            passed += c[++i].mass;
        double x = c[i].pose.x + c[i].sigma_m * nav_rng_normal(&t->rng) - t->e.pose.x;
        double y = c[i].pose.y + c[i].sigma_m * nav_rng_normal(&t->rng) - t->e.pose.y;
        double turn = c[i].pose.theta + c[i].sigma_rad * nav_rng_normal(&t->rng) - t->e.pose.theta;
        near += hypot(x, y) <= 0.25 && cos(turn) >= cos(0.5);
    }
    for (i = 0; i < n; i++) {
        double x = c[i].pose.x - t->e.pose.x, y = c[i].pose.y - t->e.pose.y;
        square += c[i].mass * (x * x + y * y + 2.0 * c[i].sigma_m * c[i].sigma_m);
    }
    return (struct counted){(double)near / DRAWS, sqrt(square)};
}

/* Kernels and lattices make a listed belief wider than the covariance, by less than KERNEL. */
static void judge(struct tried *t, const char *state)
{
    struct counted c = count(t);
    double off = fabs(t->e.confidence - c.near), given = sqrt(t->e.covariance[0] + t->e.covariance[4]);
    double ratio = fmax(given, FINEST_M) / fmax(c.spread, FINEST_M);
    t->worst = fmax(t->worst, off);
    t->ratio = fabs(log(ratio)) > fabs(log(t->ratio)) ? ratio : t->ratio;
    if (off > LARGEST || fabs(log(ratio)) > log(KERNEL))
        print_error("%s, %s: confidence %.3f, counted %.3f; spread %.4f m, counted %.4f m\n", t->name, state,
                    t->e.confidence, c.near, given, c.spread);
}

static void step(struct tried *t, struct nav_row row, const char *state)
{
    t->t_s += 0.1;
    row.t_s = t->t_s;
    nav_filter_step(t->filter, &row, &t->e);
    judge(t, state);
}

static void read_rows(struct tried *t, int rows, const char *state)
{
    for (int n = 0; n < rows; n++)
        step(t, *wander_on(&t->w), state);
}

static void blind_rows(struct tried *t, int rows, double motion, double turn, const char *state)
{
    for (int n = 0; n < rows; n++)
        step(
            t,
            (struct nav_row){.odometry = {motion, 0.0, turn}, .texture = NOT_READ_TEXTURE, .radial_m = NOT_READ_RADIAL},
            state);
}

static void set(struct tried *t, const struct nav_prior *prior, const char *state)
{
    assert_null(nav_filter_reset(t->filter, prior));
    t->t_s = 0.0;
    read_rows(t, 3, state);
    blind_rows(t, 5, 0.05, 0.1, state);
}

/* Blind rows of a belief that was right, then readings again where it is wrong. */
static void lose(struct tried *t)
{
    read_rows(t, 60, "known");
    blind_rows(t, 10, 0.0, 0.0, "blind, standing");
    blind_rows(t, 20, 0.1, 0.03, "blind, 0.1 m a row");
    blind_rows(t, 5, 0.02, 0.3, "blind, turning");
    read_rows(t, 60, "read again");
    t->t_s += 20.0;
    read_rows(t, 20, "after a gap");
    t->t_s += 1.0;
    blind_rows(t, 5, 0.02, 0.0, "blind after a gap");
    t->w.pose = (struct nav_pose){0.4, 1.7, -1.0};
    read_rows(t, 80, "kidnapped");
    blind_rows(t, 4, 0.02, 0.1, "kidnapped, blind");
    read_rows(t, 40, "kidnapped");
}

static void set_poses(struct tried *t)
{
    const struct nav_component two[] = {{{0.5, 0.5, 0.0}, 0.05, 0.1, 0.6}, {{1.5, 1.5, 2.0}, 0.1, 0.2, 0.4}};
    const struct nav_prior narrow = {.mean = {0.6, 0.7, 1.0}, .sigma = {0.05, 0.05, 0.1}},
                           wide = {.mean = {1.0, 0.5, 1.0}, .sigma = {0.3, 0.2, 0.5}},
                           turned = {.mean = {1.0, 0.5, 1.0}, .sigma = {0.05, 0.05, 3.0}},
                           mixed = {.component = two, .components = 2}, unknown = {.uniform = true};
    set(t, &narrow, "set");
    set(t, &wide, "set, wide");
    set(t, &turned, "set, heading unknown");
    set(t, &mixed, "set, two places");
    set(t, &unknown, "unknown");
    read_rows(t, 100, "unknown");
    blind_rows(t, 10, 0.1, 0.0, "unknown, blind");
    read_rows(t, 60, "unknown, read again");
    blind_rows(t, 100, 1.0, 0.0, "blind, 1 m a row");
    assert_true(t->e.confidence < 0.05);
}

static void begin(struct tried *t, int index, uint64_t seed)
{
    *t = (struct tried){.name = nav_filter_name(index), .w = wander_new(seed), .ratio = 1.0};
    t->filter = nav_filter_new(t->name, &t->w.problem);
    assert_non_null(t->filter);
    nav_rng_seed(&t->rng, seed, 1);
}

static void done(struct tried *t)
{
    print_message("%s: confidence at most %.4f off, spread given by that counted %.2f\n", t->name, t->worst, t->ratio);
    nav_filter_free(t->filter);
    assert_true(t->worst <= LARGEST && fabs(log(t->ratio)) <= log(KERNEL));
}

static void confidence_is_the_mass_near_the_pose(void **state)
{
    (void)state;
    for (int index = 0; index < FILTERS; index++) {
        struct tried t;
        begin(&t, index, 11);
        lose(&t);
        set_poses(&t);
        done(&t);
    }
}

/* Two places look alike for ever. */
static void confidence_is_the_mass_near_the_pose_of_twins(void **state)
{
    (void)state;
    for (int index = 0; index < FILTERS; index++) {
        struct tried t;
        begin(&t, index, 12);
        struct nav_problem p = t.w.problem;
        p.arena.floor = WANDER_TWIN_FLOOR;
        p.arena.boxes = 0;
        p.prior.uniform = true;
        nav_filter_free(t.filter);
        t.w.problem = p;
        t.filter = nav_filter_new(t.name, &p);
        read_rows(&t, 150, "twins");
        blind_rows(&t, 10, 0.1, 0.05, "twins, blind");
        read_rows(&t, 50, "twins");
        done(&t);
    }
}

/* Two rows say so: a quarter of the belief stays. */
static void a_robot_that_was_carried_may_be_anywhere(void **state)
{
    (void)state;
    for (int index = 0; index < FILTERS; index++) {
        struct tried t;
        begin(&t, index, 13);
        read_rows(&t, 60, "known");
        blind_rows(&t, 2, INFINITY, 0.0, "carried");
        assert_true(t.e.confidence < 0.35);
        blind_rows(&t, 3, 0.05, 0.1, "carried, blind");
        t.w.pose = (struct nav_pose){0.4, 1.7, -1.0};
        read_rows(&t, 80, "carried, read again");
        assert_int_equal(nav_filter_bad_cells(t.filter), 0);
        done(&t);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(confidence_is_the_mass_near_the_pose),
        cmocka_unit_test(confidence_is_the_mass_near_the_pose_of_twins),
        cmocka_unit_test(a_robot_that_was_carried_may_be_anywhere),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
