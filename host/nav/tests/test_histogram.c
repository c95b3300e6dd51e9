/* The histogram: against a dense computation in double precision, cell by cell, and by what must stay as it is. */
#include <stdlib.h>

#include "mixture.h"
#include "near.h"
#include "problem.h"

static const struct nav_pose STILL = {0.0, 0.0, 0.0};
static const struct nav_weigh NOTHING = {.group = NULL};

static struct nav_histogram empty(double size, double cell, int headings, int level)
{
    struct nav_histogram h;
    const struct nav_levels levels = {size, size, cell, headings, 2};
    assert_int_equal(nav_histogram_init(&h, &levels, level, 8192), 0);
    nav_histogram_clear(&h, level);
    return h;
}

static struct nav_pose centre(const struct nav_histogram *h, int i, int j, int p)
{
    return (struct nav_pose){(i + 0.5) * h->shape.cell + nav_histogram_shift_x(h, p),
                             (j + 0.5) * h->shape.cell + nav_histogram_shift_y(h, p), nav_histogram_heading(h, p)};
}

static void put(struct nav_histogram *h, int i, int j, int p, double mass)
{
    struct nav_grain grain = {.pose = centre(h, i, j, p), .mass = mass};
    nav_histogram_add(h, &grain, 1);
}

static void pass(struct nav_histogram *h, struct nav_pose step, const struct nav_weigh *weigh)
{
    nav_histogram_pass(h, step, weigh, STILL);
}

static void move(struct nav_histogram *h, struct nav_pose step, double position, double heading)
{
    h->pending_position += position;
    h->pending_heading += heading;
    pass(h, step, &NOTHING);
}

/* All cells: [nh][ny][nx]. */
struct dense {
    const struct nav_histogram *h;
    double *cell;
};

static void dense_take(void *self, struct nav_pose at, double mass)
{
    const struct dense *d = self;
    const struct nav_shape *s = &d->h->shape;
    int p = (int)lround((at.theta - d->h->rotation) / s->cell_theta - 0.5 + 4.0 * s->nh) % s->nh;
    int i = (int)lround((at.x - d->h->shift_x[p]) / s->cell - 0.5);
    int j = (int)lround((at.y - d->h->shift_y[p]) / s->cell - 0.5);
    assert_in_range(i, 0, s->nx - 1);
    assert_in_range(j, 0, s->ny - 1);
    d->cell[(p * s->ny + j) * s->nx + i] += mass;
}

static double *dense(const struct nav_histogram *h)
{
    struct dense d = {h, calloc((size_t)nav_shape_inside(&h->shape), sizeof *d.cell)};
    nav_histogram_each(h, dense_take, &d);
    return d.cell;
}

static double total(const struct nav_histogram *h)
{
    double *cell = dense(h), sum = 0.0;
    for (size_t n = 0; n < (size_t)nav_shape_inside(&h->shape); n++)
        sum += cell[n];
    free(cell);
    return sum;
}

static void small_steps_keep_a_sharp_belief_sharp_and_exact(void **state)
{
    (void)state;
    struct nav_histogram h = empty(3.0, 0.05, 36, 0);
    const double heading = 2.5 * NAV_PI / 18.0;
    put(&h, 10, 10, 2, 1.0);
    for (int step = 0; step < 100; step++)
        move(&h, (struct nav_pose){0.015, 0.0, 0.0}, 0.0, 0.0);
    assert_near((double)h.heaviest, 1.0, 0.0);
    assert_int_equal(h.cells, 1);
    assert_near(h.mode.x, 10.5 * 0.05 + 1.5 * cos(heading), 1e-9);
    assert_near(h.mode.y, 10.5 * 0.05 + 1.5 * sin(heading), 1e-9);
    nav_histogram_free(&h);
}

static void turning_and_driving_follow_the_pose(void **state)
{
    (void)state;
    struct nav_histogram h = empty(3.0, 0.05, 36, 0);
    put(&h, 30, 30, 7, 1.0);
    struct nav_pose expected = centre(&h, 30, 30, 7);
    for (int step = 0; step < 110; step++) {
        struct nav_pose way =
            step % 40 < 20 ? (struct nav_pose){0.0123, 0.001, 0.0} : (struct nav_pose){0.0, 0.0, NAV_PI / 40.0};
        move(&h, way, 0.0, 0.0);
        expected = nav_compose(expected, way);
    }
    assert_near(h.total, 1.0, 0.0);
    assert_near(h.mode.x, expected.x, 1e-9);
    assert_near(h.mode.y, expected.y, 1e-9);
    assert_near(nav_wrap(h.mode.theta - expected.theta), 0.0, 1e-9);
    nav_histogram_free(&h);
}

/* The belief as it is, and nothing pending. */
static void summarise(const struct nav_histogram *h, struct nav_gaussian *out)
{
    const struct nav_pending none = {.noise = {-h->pending_position, -h->pending_heading}};
    nav_histogram_mode(h, &out->mean);
    nav_histogram_covariance(h, &none, out->mean, out->covariance);
}

static void noise_adds_the_variance_asked_for_and_keeps_the_mass(void **state)
{
    (void)state;
    struct nav_histogram h = empty(3.0, 0.05, 36, 0);
    struct nav_gaussian before, after;
    put(&h, 30, 30, 18, 1.0);
    move(&h, STILL, 0.0, 0.0);
    summarise(&h, &before);
    for (int step = 0; step < 50; step++)
        move(&h, STILL, 1e-4, 4e-4);
    move(&h, STILL, 0.01, 0.0); /* as much as one pass can add, and more */
    summarise(&h, &after);
    assert_near(h.pending_position, 0.0, 0.01 - 8e-3 * 0.6);
    assert_near(total(&h), 1.0, 1e-5);
    assert_near(after.mean.x, before.mean.x, 2e-3); /* cells right on the circle may fall on either side */
    assert_near(after.covariance[0] - before.covariance[0], 0.015 - h.pending_position, 1e-5);
    assert_near(after.covariance[4] - before.covariance[4], 0.015 - h.pending_position, 1e-5);
    assert_near(after.covariance[8] - before.covariance[8], 50 * 4e-4 - h.pending_heading, 1e-4);
    assert_near(after.covariance[1], 0.0, 1e-5);
    nav_histogram_free(&h);
}

static void mass_that_leaves_the_arena_is_lost(void **state)
{
    (void)state;
    struct nav_histogram h = empty(1.0, 0.1, 4, 0);
    put(&h, 5, 5, 0, 0.5);
    put(&h, 9, 0, 0, 0.5);
    move(&h, STILL, 0.3 * 0.01, 0.0);
    assert_near(total(&h), 0.5 + 0.5 * 0.85 * 0.85, 1e-6); /* of a cell in the corner, 0.15 beyond either wall */
    move(&h, (struct nav_pose){5.0, 0.0, 0.0}, 0.0, 0.0);
    assert_near(h.total, 0.0, 0.0);
    nav_histogram_free(&h);
}

/* A likelihood that differs from cell to cell. */
static double likelihood(int p, int j, int i)
{
    return (double)((p * 31 + j * 17 + i * 7) % 23) / 22.0;
}

static long weigh_group(void *self, int p, int line, int group, const float *mass, float *like)
{
    (void)self;
    (void)mass;
    for (int k = 0; k < NAV_LANES; k++)
        like[k] = (float)likelihood(p, line, group * NAV_LANES + k);
    return 3;
}

static double kernel(const double *cell, const struct nav_shape *s, int p, int j, int i, double side)
{
    double sum = 0.0;
    for (int dj = -1; dj <= 1; dj++) {
        for (int di = -1; di <= 1; di++) {
            double weight = (dj ? side : 1.0 - 2.0 * side) * (di ? side : 1.0 - 2.0 * side);
            if (j + dj >= 0 && j + dj < s->ny && i + di >= 0 && i + di < s->nx)
                sum += weight * cell[(p * s->ny + j + dj) * s->nx + i + di];
        }
    }
    return sum;
}

/* A pass of a belief that has not moved, in double precision: headings are blurred, then positions, then it is weighed.
 */
static void naive(double *cell, const struct nav_shape *s, double side, double turn, double extra, double least)
{
    size_t each = (size_t)(s->nx * s->ny), all = each * (size_t)s->nh;
    double *turned = calloc(all, sizeof *turned);
    for (size_t n = 0; n < all; n++)
        turned[n] = (1.0 - 2.0 * turn) * cell[n] + turn * (cell[(n + each) % all] + cell[(n + all - each) % all]);
    for (size_t n = 0; n < all; n++) {
        int i = (int)n % s->nx, j = (int)n / s->nx % s->ny, p = (int)(n / each);
        double mass = kernel(turned, s, p, j, i, side) + extra;
        cell[n] = mass >= least ? mass * likelihood(p, j, i) : 0.0;
    }
    free(turned);
}

/* Scattered cells of a histogram whose lines end amid a group. */
static struct nav_histogram scattered(void)
{
    struct nav_histogram h = empty(1.9, 0.1, 12, 0);
    for (int n = 0; n < 60; n++)
        put(&h, n * n % 19, n * 7 % 19, n * 5 % 12, 1.0 / 60.0);
    return h;
}

static void a_pass_is_what_a_dense_computation_gives(void **state)
{
    (void)state;
    for (int kind = 0; kind < 3; kind++) { /* mass alone; light cells dropped; belief added everywhere */
        struct nav_histogram h = scattered();
        const struct nav_weigh weigh = {weigh_group, NULL, kind == 1 ? 1e-3 : 0.0, kind == 2 ? 1e-4 : 0.0, NULL};
        double *expected = dense(&h);
        naive(expected, &h.shape, 0.2, 0.15, weigh.extra, weigh.least);
        h.pending_position = 0.4 * h.shape.cell * h.shape.cell;
        h.pending_heading = 0.3 * h.shape.cell_theta * h.shape.cell_theta;
        pass(&h, STILL, &weigh);
        double *got = dense(&h), sum = 0.0;
        long cells = 0;
        for (size_t n = 0; n < (size_t)nav_shape_inside(&h.shape); n++) {
            assert_near(got[n], expected[n], 1e-7);
            sum += got[n];
            cells += got[n] > 0.0;
        }
        assert_near(h.total, sum, 1e-6);
        assert_int_equal(h.cells, cells);
        free(expected);
        free(got);
        nav_histogram_free(&h);
    }
}

/* After half a metre the slices' shifts differ by tens of millimetres. */
static void mass_poured_between_shifted_slices_stays_within_half_a_cell(void **state)
{
    (void)state;
    struct nav_histogram h = empty(2.0, 0.05, 8, 0);
    struct nav_gaussian all;
    put(&h, 20, 20, 0, 1.0);
    move(&h, (struct nav_pose){0.512, 0.0, 0.0}, 0.0, 0.0);
    struct nav_pose there = h.mode;
    move(&h, STILL, 0.0, 0.1);
    assert_near(total(&h), 1.0, 1e-6);
    assert_int_equal(h.cells, 3);
    summarise(&h, &all);
    double within = 0.05 * 0.05 / 12.0;
    assert_true(all.covariance[0] < within + 0.025 * 0.025 && all.covariance[4] < within + 0.025 * 0.025);
    assert_true(nav_histogram_near(&h, there, NULL) < 0.95);
    nav_histogram_free(&h);
}

static void a_uniform_belief_stays_uniform_and_takes_no_memory_before_it_is_weighed(void **state)
{
    (void)state;
    struct nav_histogram h = empty(1.9, 0.1, 12, 0);
    nav_histogram_restart(&h, 0);
    assert_near(total(&h), 1.0, 1e-9);
    move(&h, (struct nav_pose){0.3, 0.0, 0.2}, 0.01, 0.01);
    double *cell = dense(&h), each = 1.0 / nav_shape_inside(&h.shape);
    for (size_t n = 0; n < (size_t)nav_shape_inside(&h.shape); n++)
        assert_near(cell[n], each, 1e-9);
    free(cell);
    nav_histogram_free(&h);
}

/* Coarse cells with shifts of their own become finer ones in the same place. */
static void a_refined_belief_is_the_same_belief_in_finer_cells(void **state)
{
    (void)state;
    struct nav_histogram h = empty(2.0, 0.05, 24, 1);
    struct nav_gaussian before, after;
    put(&h, 8, 8, 3, 0.5);
    put(&h, 9, 8, 3, 0.25);
    put(&h, 8, 11, 4, 0.25);
    move(&h, (struct nav_pose){0.137, 0.0, 0.4}, 0.0, 0.0);
    summarise(&h, &before);
    assert_int_equal(h.shape.nh, 12);
    assert_true(nav_histogram_refine(&h));
    assert_int_equal(h.shape.nh, 24);
    assert_int_equal(h.cells, 3 * 8);
    assert_near(total(&h), 1.0, 1e-6);
    move(&h, STILL, 0.0, 0.0); /* sums taken anew */
    summarise(&h, &after);
    assert_near(after.mean.x, before.mean.x, 0.02);
    assert_near(after.mean.theta, before.mean.theta, 0.05);
    for (int k = 0; k < 9; k += 4)
        assert_near(after.covariance[k] / before.covariance[k], 1.0, 0.02);
    assert_false(nav_histogram_refine(&h)); /* there is no finer level */
    nav_histogram_free(&h);
}

static void poses_are_added_to_the_cells_that_hold_them(void **state)
{
    (void)state;
    struct nav_histogram h = empty(2.0, 0.1, 12, 0);
    put(&h, 3, 4, 5, 0.5);
    struct nav_grain grain[] = {{.pose = centre(&h, 3, 4, 5), .mass = 0.25},
                                {.pose = centre(&h, 17, 4, 5), .mass = 0.25},
                                {.pose = {-0.01, 1.0, 0.0}, .mass = 1.0}, /* beyond a wall */
                                {.pose = centre(&h, 3, 4, 5), .mass = 0.5}};
    grain[1].pose.x += 0.049;
    grain[1].pose.theta -= 2.0 * NAV_PI;
    nav_histogram_add(&h, grain, 4);
    double *cell = dense(&h);
    assert_near(cell[(5 * 20 + 4) * 20 + 3], 1.25, 1e-6);
    assert_near(cell[(5 * 20 + 4) * 20 + 17], 0.25, 1e-6);
    assert_near(h.total, 1.5, 1e-9);
    free(cell);
    nav_histogram_free(&h);
}

static void poses_are_drawn_within_cells_by_their_mass(void **state)
{
    (void)state;
    enum { COUNT = 1000 };
    static struct nav_pose pose[COUNT + 1];
    struct nav_histogram h = empty(2.0, 0.1, 12, 0);
    struct nav_rng rng;
    put(&h, 3, 4, 5, 0.75);
    put(&h, 15, 4, 5, 0.25);
    struct nav_pose first = centre(&h, 3, 4, 5);
    nav_rng_seed(&rng, 1, 0);
    long drawn = nav_histogram_draw(&h, &rng, COUNT, pose, COUNT + 1), there = 0;
    assert_in_range(drawn, COUNT - 1, COUNT + 1);
    for (long n = 0; n < drawn; n++)
        there += fabs(pose[n].x - first.x) <= 0.05 && fabs(pose[n].y - first.y) <= 0.05 &&
                 fabs(pose[n].theta - first.theta) <= NAV_PI / 12.0;
    assert_in_range(there, 749, 751);
    nav_histogram_free(&h);
}

static void near_counts_the_mass_around_a_pose_across_the_heading_seam(void **state)
{
    (void)state;
    struct nav_histogram h = empty(2.0, 0.1, 36, 0);
    put(&h, 10, 10, 0, 1.0);
    put(&h, 11, 10, 35, 1.0);
    put(&h, 14, 10, 0, 1.0);
    put(&h, 10, 10, 2, 1.0);
    put(&h, 12, 12, 0, 1.0); /* within 0.25 m of it in x and in y, not as the crow flies */
    put(&h, 10, 10, 10, 1.0);
    struct nav_pose mean = {0.0, 0.0, 0.0};
    assert_near(nav_histogram_near(&h, (struct nav_pose){1.05, 1.05, 0.0}, &mean), 3.0, 1e-6);
    assert_near(mean.x, 1.05 + 0.1 / 3.0, 1e-9);
    assert_near(mean.theta, 2.5 * NAV_PI / 18.0 / 3.0, 1e-9);
    nav_histogram_free(&h);
}

static void a_prior_fills_cells_with_its_integral(void **state)
{
    (void)state;
    struct nav_histogram h = empty(1.0, 0.1, 36, 0);
    struct nav_gaussian all;
    const struct nav_prior prior = {.mean = {0.5, 0.5, 3.1}, .sigma = {0.05, 0.1, 0.3}};
    nav_mixture_fill(&prior, &h);
    assert_near(total(&h), 1.0, 1e-5);
    pass(&h, STILL, &NOTHING);
    summarise(&h, &all);
    /* A histogram's variance: the density's, and twice the width^2 / 12 of a cell (integrating and spreading). */
    assert_near(all.covariance[0], 0.0025 + 0.01 / 6.0, 2e-4);
    assert_near(all.covariance[4], 0.01 + 0.01 / 6.0, 2e-4);
    assert_near(all.covariance[8], 0.09 + pow(NAV_PI / 18.0, 2.0) / 6.0, 1e-3);
    /* A heading so uncertain that it reaches around: no mass is lost at the seam. */
    nav_histogram_clear(&h, 0);
    nav_mixture_fill(&(struct nav_prior){.mean = {0.5, 0.5, 3.1}, .sigma = {0.05, 0.1, 1.5}}, &h);
    assert_near(total(&h), 1.0, 1e-5);
    nav_histogram_free(&h);
}

static void more_cells_than_can_be_numbered_are_refused(void **state)
{
    (void)state;
    struct nav_histogram h;
    const struct nav_levels levels = {1e6, 1e6, 0.05, 36, 2};
    assert_int_equal(nav_histogram_init(&h, &levels, 0, 0), -1);
    nav_histogram_free(&h);
}

static void cells_are_listed_where_they_will_be_and_as_wide(void **state)
{
    (void)state;
    struct nav_histogram h = empty(3.0, 0.05, 36, 0);
    struct nav_component one;
    put(&h, 30, 30, 7, 2.0);
    struct nav_pose there = centre(&h, 30, 30, 7);
    const struct nav_pending pending = {.step = {0.1, 0.0, 0.2}, .noise = {1e-4, 1e-3}};
    h.pending_position = 2e-4;
    h.pending_heading = 2e-3;
    assert_int_equal(nav_histogram_components(&h, &pending, 0.5, &one, 1), 1);
    assert_near(one.pose.x, there.x + 0.1 * cos(there.theta), 1e-9);
    assert_near(one.pose.theta, there.theta + 0.2, 1e-9);
    assert_near(one.sigma_m, sqrt(0.05 * 0.05 / 12.0 + 3e-4), 1e-9);
    assert_near(one.sigma_rad, sqrt(h.shape.cell_theta * h.shape.cell_theta / 12.0 + 3e-3), 1e-9);
    assert_near(one.mass, 0.5, 1e-9);
    nav_histogram_free(&h);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(small_steps_keep_a_sharp_belief_sharp_and_exact),
        cmocka_unit_test(turning_and_driving_follow_the_pose),
        cmocka_unit_test(noise_adds_the_variance_asked_for_and_keeps_the_mass),
        cmocka_unit_test(mass_that_leaves_the_arena_is_lost),
        cmocka_unit_test(a_pass_is_what_a_dense_computation_gives),
        cmocka_unit_test(mass_poured_between_shifted_slices_stays_within_half_a_cell),
        cmocka_unit_test(a_uniform_belief_stays_uniform_and_takes_no_memory_before_it_is_weighed),
        cmocka_unit_test(a_refined_belief_is_the_same_belief_in_finer_cells),
        cmocka_unit_test(poses_are_added_to_the_cells_that_hold_them),
        cmocka_unit_test(poses_are_drawn_within_cells_by_their_mass),
        cmocka_unit_test(near_counts_the_mass_around_a_pose_across_the_heading_seam),
        cmocka_unit_test(a_prior_fills_cells_with_its_integral),
        cmocka_unit_test(more_cells_than_can_be_numbered_are_refused),
        cmocka_unit_test(cells_are_listed_where_they_will_be_and_as_wide),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
