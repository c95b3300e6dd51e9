/* Regions and bins of beliefs whose answers are known. */
#include "belief.h"

#include <math.h>
#include <stdlib.h>

#include "gaussian.h"
#include "near.h"

static const double PI = NAV_PI;

static double level(const struct nav_component *c, long n, double x, double y)
{
    struct nav_region region;
    (void)nav_belief_region(c, n, x, y, &region);
    return region.level;
}

/* Lattice of points of a normal with these standard deviations, as Gaussian filters list theirs. */
static long normal(struct nav_component *out, double sx, double sy, double spacing)
{
    long n = 0;
    for (double x = -5.0 * sx; x <= 5.0 * sx; x += spacing) {
        for (double y = -5.0 * sy; y <= 5.0 * sy; y += spacing) {
            double z = x * x / (sx * sx) + y * y / (sy * sy);
            out[n++] = (struct nav_component){{1.0 + x, 2.0 + y, 0.0}, spacing / sqrt(12.0), 0.1, exp(-0.5 * z)};
        }
    }
    return n;
}

static void levels_and_area_of_a_normal(void **state)
{
    (void)state;
    static struct nav_component c[40000];
    long n = normal(c, 0.2, 0.1, 0.02);
    struct nav_region r;
    for (double z = 0.5; z < 3.0; z += 0.5) { /* level of the contour at z: 1 - exp(-z^2 / 2) */
        assert_int_equal(nav_belief_region(c, n, 1.0 + 0.2 * z, 2.0, &r), 0);
        assert_near(r.level, 1.0 - exp(-0.5 * z * z), 0.03);
        assert_near(level(c, n, 1.0, 2.0 - 0.1 * z), 1.0 - exp(-0.5 * z * z), 0.06);
    }
    assert_near(r.area_m2, PI * 0.2 * 0.1 * -2.0 * log(0.1), 0.003);
    assert_near(level(c, n, 9.0, 9.0), 1.0, 0.0);
}

static void a_long_thin_gaussian_leaves_no_gaps(void **state)
{
    (void)state;
    static struct nav_component c[10000];
    /* Standard deviations 0.2 along (1, 1) and 0.05 across. */
    const double a = (0.04 + 0.0025) / 2.0, b = (0.04 - 0.0025) / 2.0;
    const struct nav_gaussian g = {{1.0, 1.0, 0.0}, {a, b, 0.0, b, a, 0.0, 0.0, 0.0, 0.01}};
    long n = nav_gaussian_components(&g, c, 10000);
    assert_in_range(n, 1, 10000);
    for (double z = 0.2; z < 3.0; z += 0.2) { /* the 90 % contour is at 2.15 */
        double along = 0.2 * z / sqrt(2.0), across = 0.05 * z / sqrt(2.0);
        if (fabs(z - 2.15) < 0.25)
            continue;
        assert_int_equal(level(c, n, 1.0 + along, 1.0 + along) <= 0.9, z < 2.15);
        assert_int_equal(level(c, n, 1.0 + across, 1.0 - across) <= 0.9, z < 2.15);
    }
}

/* Side by side along the longer axis: neither gaps, nor a belief made wider by components that overlap. */
static void components_of_a_gaussian_are_as_wide_as_they_lie_apart(void **state)
{
    (void)state;
    static struct nav_component c[10000];
    static const double sigmas[][2] = {{0.2, 0.2}, {0.2, 0.05}, {0.05, 0.2}};
    for (int k = 0; k < 3; k++) {
        const double sx = sigmas[k][0], sy = sigmas[k][1];
        const struct nav_gaussian g = {{1.0, 1.0, 0.0}, {sx * sx, 0, 0, 0, sy * sy, 0, 0, 0, 0.01}};
        long n = nav_gaussian_components(&g, c, 10000);
        double apart = 1.0;
        for (long i = 0; i < n; i++) {
            double along = sx >= sy ? c[i].pose.x - c[0].pose.x : c[i].pose.y - c[0].pose.y;
            apart = along > 1e-9 ? fmin(along, apart) : apart;
        }
        for (long i = 0; i < n; i++)
            assert_near(c[i].sigma_m * sqrt(12.0), apart, 1e-9);
    }
}

static void a_region_may_have_two_parts(void **state)
{
    (void)state;
    const struct nav_component c[] = {{{0.5, 0.5, 0.0}, 0.01, 0.1, 6.0}, {{2.0, 1.5, 0.0}, 0.02, 0.1, 3.0}};
    double first = 12.0 * 1e-4, second = 12.0 * 4e-4; /* squares with those standard deviations */
    struct nav_region r;
    assert_int_equal(nav_belief_region(c, 2, 2.0, 1.5, &r), 0);
    assert_true(r.level > 6.0 / 9.0 && r.level < 1.0);
    double area = first + second * (0.9 * 9.0 - 6.0) / 3.0; /* more by the bins that an edge cuts */
    assert_true(r.area_m2 > 0.95 * area && r.area_m2 < 1.35 * area);
    assert_true(level(c, 2, 0.5, 0.5) < 6.0 / 9.0);
    assert_near(level(c, 2, 1.2, 1.0), 1.0, 1e-9);
}

static void a_point_mass_and_no_mass(void **state)
{
    (void)state;
    struct nav_component c = {{0.5, 0.5, 0.0}, 0.0, 0.0, 1.0};
    struct nav_region r;
    assert_int_equal(nav_belief_region(&c, 1, 0.5, 0.5, &r), 0);
    assert_near(r.level, 0.5, 1e-12);
    assert_near(level(&c, 1, 0.6, 0.5), 1.0, 0.0);
    assert_int_equal(nav_belief_region(&c, 0, 0.5, 0.5, &r), -1);
    c.pose.x = NAN;
    assert_int_equal(nav_belief_region(&c, 1, 0.5, 0.5, &r), -1);
    assert_near(r.level, 1.0, 0.0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(levels_and_area_of_a_normal),
        cmocka_unit_test(a_long_thin_gaussian_leaves_no_gaps),
        cmocka_unit_test(components_of_a_gaussian_are_as_wide_as_they_lie_apart),
        cmocka_unit_test(a_region_may_have_two_parts),
        cmocka_unit_test(a_point_mass_and_no_mass),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
