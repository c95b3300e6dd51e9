#include "lattice.h"

#include "lattice_rows.h"
#include "near.h"

static const struct nav_noise NO_NOISE = {0.0, 0.0};

static double total(const struct nav_lattice *l)
{
    double sum = 0.0;
    for (size_t i = 0; i < nav_lattice_cells(l); i++)
        sum += (double)l->mass[i];
    return sum;
}

static struct nav_pose mode(const struct nav_lattice *l)
{
    size_t best = 0;
    for (int p = 0; p < l->nh; p++) {
        size_t cell = nav_lattice_peak(l, p);
        best = l->mass[cell] > l->mass[best] ? cell : best;
    }
    const struct nav_slices slices = nav_lattice_slices(l);
    return nav_slices_centre(&slices, best);
}

static double near(const struct nav_lattice *l, struct nav_pose pose, struct nav_pose *mean)
{
    const struct nav_slices slices = nav_lattice_slices(l);
    return nav_slices_near(&slices, pose, mean) * l->scale;
}

static void spread(const struct nav_lattice *l, struct nav_pose about, double covariance[9])
{
    const struct nav_slices slices = nav_lattice_slices(l);
    nav_slices_covariance(&slices, about, covariance);
}

static void move(struct nav_lattice *l, struct nav_pose step, const struct nav_noise *noise)
{
    nav_lattice_shift(l, step, noise);
    nav_lattice_pass(l, NULL, (struct nav_pose){0.0, 0.0, 0.0});
}

/* All mass in one cell. */
static struct nav_lattice peak(double size, double cell, int headings, int i, int j, int p)
{
    struct nav_lattice l;
    assert_int_equal(nav_lattice_init(&l, size, size, cell, headings), 0);
    nav_lattice_slice(&l, p)[j * l.nx + i] = 1.0f;
    return l;
}

static void small_steps_keep_a_sharp_belief_sharp_and_exact(void **state)
{
    (void)state;
    struct nav_lattice l = peak(3.0, 0.05, 36, 10, 10, 2);
    const double heading = 2.5 * NAV_PI / 18.0;
    for (int step = 0; step < 100; step++)
        move(&l, (struct nav_pose){0.015, 0.0, 0.0}, &NO_NOISE);
    struct nav_pose end = mode(&l);
    assert_near(total(&l), 1.0, 0.0);
    assert_near((double)nav_lattice_slice(&l, 2)[(int)(end.y / 0.05) * l.nx + (int)(end.x / 0.05)], 1.0, 0.0);
    assert_near(end.x, 10.5 * 0.05 + 1.5 * cos(heading), 1e-9);
    assert_near(end.y, 10.5 * 0.05 + 1.5 * sin(heading), 1e-9);
    nav_lattice_free(&l);
}

static void turning_and_driving_follow_the_pose(void **state)
{
    (void)state;
    struct nav_lattice l = peak(3.0, 0.05, 36, 30, 30, 7);
    struct nav_pose expected = mode(&l);
    for (int step = 0; step < 110; step++) {
        struct nav_pose way =
            step % 40 < 20 ? (struct nav_pose){0.0123, 0.001, 0.0} : (struct nav_pose){0.0, 0.0, NAV_PI / 40.0};
        move(&l, way, &NO_NOISE);
        expected = nav_compose(expected, way);
    }
    struct nav_pose end = mode(&l);
    assert_near(total(&l), 1.0, 0.0);
    assert_near(end.x, expected.x, 1e-9);
    assert_near(end.y, expected.y, 1e-9);
    assert_near(nav_wrap(end.theta - expected.theta), 0.0, 1e-9);
    nav_lattice_free(&l);
}

static void noise_adds_the_variance_asked_for_and_keeps_the_mass(void **state)
{
    (void)state;
    struct nav_lattice l = peak(3.0, 0.05, 36, 30, 30, 18);
    struct nav_pose start = mode(&l), mean = start;
    const struct nav_noise noise = {.position = 1e-4, .heading = 4e-4};
    double before[9], after[9];
    nav_lattice_pass(&l, NULL, start);
    spread(&l, start, before);
    for (int step = 0; step < 50; step++)
        move(&l, (struct nav_pose){0.0, 0.0, 0.0}, &noise);
    double owed = l.owed_position, owed_heading = l.owed_heading;
    assert_near(total(&l), 1.0, 1e-5);
    near(&l, start, &mean);
    spread(&l, start, after);
    assert_near(mean.x, start.x, 5e-4); /* cells right on the circle may fall on either side */
    assert_near(after[0] - before[0], 50 * 1e-4 - owed, 1e-5);
    assert_near(after[4] - before[4], 50 * 1e-4 - owed, 1e-5);
    assert_near(after[8] - before[8], 50 * 4e-4 - owed_heading, 1e-4);
    assert_near(after[1], 0.0, 1e-6);
    nav_lattice_free(&l);
}

static void mass_poured_between_shifted_slices_keeps_its_place(void **state)
{
    (void)state;
    struct nav_lattice l = peak(2.0, 0.05, 8, 20, 20, 0);
    /* After half a metre the slices' shifts differ by tens of millimetres. */
    move(&l, (struct nav_pose){0.512, 0.0, 0.0}, &NO_NOISE);
    struct nav_pose there = mode(&l), mean = there;
    move(&l, (struct nav_pose){0.0, 0.0, 0.0}, &(struct nav_noise){0.0, 0.1});
    assert_near(total(&l), 1.0, 1e-6);
    double x = 0.0, y = 0.0;
    for (int p = 0; p < l.nh; p++) {
        for (int c = 0; c < l.nx * l.ny; c++) {
            double mass = (double)nav_lattice_slice(&l, p)[c];
            x += mass * ((c % l.nx + 0.5) * l.cell + l.shift_x[p]);
            y += mass * ((c / l.nx + 0.5) * l.cell + l.shift_y[p]);
        }
    }
    assert_near(x, there.x, 1e-6);
    assert_near(y, there.y, 1e-6);
    assert_true(near(&l, there, &mean) < 0.95);
    nav_lattice_free(&l);
}

static void mass_that_leaves_the_lattice_is_lost(void **state)
{
    (void)state;
    struct nav_lattice l = peak(1.0, 0.1, 4, 5, 5, 0);
    move(&l, (struct nav_pose){5.0, 0.0, 0.0}, &NO_NOISE);
    assert_near(total(&l), 0.0, 0.0);
    nav_lattice_free(&l);
}

static void a_prior_fills_cells_with_its_integral(void **state)
{
    (void)state;
    struct nav_lattice l;
    nav_lattice_init(&l, 1.0, 1.0, 0.1, 36);
    const struct nav_prior prior = {.mean = {0.5, 0.5, 3.1}, .sigma = {0.05, 0.1, 0.3}};
    nav_lattice_fill(&l, &prior);
    double covariance[9];
    assert_near(total(&l), 1.0, 1e-5);
    nav_lattice_pass(&l, NULL, prior.mean);
    spread(&l, prior.mean, covariance);
    /* A histogram's variance: the density's, and twice the width^2 / 12 of a cell (integrating and spreading). */
    assert_near(covariance[0], 0.0025 + 0.01 / 6.0, 2e-4);
    assert_near(covariance[4], 0.01 + 0.01 / 6.0, 2e-4);
    assert_near(covariance[8], 0.09 + pow(NAV_PI / 18.0, 2.0) / 6.0, 1e-3);
    /* A heading so uncertain that it reaches around: no mass is lost at the seam. */
    nav_lattice_fill(&l, &(struct nav_prior){.mean = {0.5, 0.5, 3.1}, .sigma = {0.05, 0.1, 1.5}});
    assert_near(total(&l), 1.0, 1e-5);
    nav_lattice_free(&l);
}

static void near_counts_the_mass_around_a_pose_across_the_heading_seam(void **state)
{
    (void)state;
    struct nav_lattice l = peak(2.0, 0.1, 36, 10, 10, 0);
    nav_lattice_slice(&l, 35)[10 * l.nx + 11] = 1.0f;
    nav_lattice_slice(&l, 0)[10 * l.nx + 14] = 1.0f;
    nav_lattice_slice(&l, 2)[10 * l.nx + 10] = 1.0f;
    nav_lattice_slice(&l, 0)[12 * l.nx + 12] = 1.0f; /* within 0.25 m of it in x and in y, not as the crow flies */
    nav_lattice_slice(&l, 10)[10 * l.nx + 10] = 1.0f;
    struct nav_pose mean = {0.0, 0.0, 0.0};
    assert_near(near(&l, (struct nav_pose){1.05, 1.05, 0.0}, &mean), 3.0, 1e-6);
    assert_near(mean.x, 1.05 + 0.1 / 3.0, 1e-9);
    assert_near(mean.theta, 2.5 * NAV_PI / 18.0 / 3.0, 1e-9);
    nav_lattice_free(&l);
}

/* The inner loops, plain and as this machine runs them, on rows that end anywhere. */
static void wide_vectors_give_the_same_bits(void **state)
{
    (void)state;
    enum { N = 53, ROOM = N + 4 * NAV_LANES };
    const struct nav_rows *kind[] = {nav_rows_plain(), nav_rows_best()};
    float in[6][ROOM], out[2][4][ROOM] = {{{0.0f}}}, *const row = in[0] + NAV_LANES;
    struct nav_row_sums sums[2] = {{.peak = {0.0f}}, {.peak = {0.0f}}};
    const float w[8] = {0.01f, 0.02f, 0.03f, 0.04f, 0.05f, 0.06f, 0.07f, 0.08f};
    for (int i = 0; i < 6 * ROOM; i++)
        in[i / ROOM][i % ROOM] = (float)((i * 7919 % 1013) / 1013.0) + 1e-7f * (float)i;
    for (int i = 0; i < ROOM; i++)
        in[5][i] = i < NAV_LANES + N ? in[5][i] : 0.0f;
    const float *const from[] = {row, in[1] + NAV_LANES, in[2] + NAV_LANES, in[3] + NAV_LANES};
    for (int k = 0; k < 2; k++) {
        kind[k]->blur(row, 0.1f, 0, N, out[k][0] + NAV_LANES);
        kind[k]->mix(in[4] + NAV_LANES, 0.1f, from, w, 0, N, out[k][1] + NAV_LANES);
        struct nav_row_weigh weigh = {from[0], from[1], from[2], in[5] + NAV_LANES,     from[3], 0.7f, 0.15f, 0.1f,
                                      1e-5f,   0,       N,       out[k][2] + NAV_LANES, 0.2f};
        kind[k]->weigh(&weigh, &sums[k]);
        weigh.out = out[k][3] + NAV_LANES;
        kind[k]->thin(&weigh);
    }
    assert_memory_equal(out[0], out[1], sizeof out[0]);
    assert_memory_equal(&sums[0], &sums[1], sizeof sums[0]);
    int dropped = 0;
    for (int i = 0; i < N; i++) {
        float spread = 0.15f * row[i] + 0.1f * (from[1][i] + from[2][i]);
        dropped += !(spread > 0.2f);
        assert_near((double)out[0][3][NAV_LANES + i], spread > 0.2f ? (double)spread : 0.0, 1e-6);
    }
    assert_in_range(dropped, 5, N - 5);
    double mass = 0.0;
    for (int i = 0; i < N; i++)
        mass += (double)out[0][2][NAV_LANES + i];
    double lanes = 0.0;
    for (int k = 0; k < NAV_LANES; k++)
        lanes += (double)sums[0].moment[0][k];
    assert_near(lanes, mass, 1e-5);
    assert_near((double)out[0][0][NAV_LANES + 3], 0.8 * (double)row[3] + 0.1 * (double)(row[2] + row[4]), 1e-6);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(small_steps_keep_a_sharp_belief_sharp_and_exact),
        cmocka_unit_test(turning_and_driving_follow_the_pose),
        cmocka_unit_test(noise_adds_the_variance_asked_for_and_keeps_the_mass),
        cmocka_unit_test(mass_poured_between_shifted_slices_keeps_its_place),
        cmocka_unit_test(wide_vectors_give_the_same_bits),
        cmocka_unit_test(mass_that_leaves_the_lattice_is_lost),
        cmocka_unit_test(a_prior_fills_cells_with_its_integral),
        cmocka_unit_test(near_counts_the_mass_around_a_pose_across_the_heading_seam),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
