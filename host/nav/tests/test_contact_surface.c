#include "contact_surface.h"

#include "near.h"

#define LENGTH 0.14
#define H(mm) (1.0 - (mm) / 181.7) /* a plug that matches the whisker */

/* A whisker on the left front: its arm, 0.16 m long, at 61 degrees, the whisker at right angles to it, pointing in. */
static struct nav_surface_mount mounted(void)
{
    double arm = 1.064, yaw = arm - 1.5707963267948966;
    return (struct nav_surface_mount){.base_m = {0.16 * cos(arm), 0.16 * sin(arm)},
                                      .yaw_rad = yaw,
                                      .length_m = LENGTH,
                                      .kappa = 1.0,
                                      .cone_mm = 181.7,
                                      .spread = 0.05,
                                      .corner_low_mm = 60.0,
                                      .corner_high_mm = 138.0};
}

/* Bending of a corner at a radius, by moving the robot a little and watching the point of the whisker. */
static struct nav_surface_seen corner_at(const struct nav_surface_mount *m, double mm)
{
    double c = cos(m->yaw_rad), s = sin(m->yaw_rad), a = mm * 1e-3;
    double x = m->base_m[0] + a * c, y = m->base_m[1] + a * s;
    return (struct nav_surface_seen){H(mm) * -s / a, H(mm) * (y * s + x * c) / a};
}

/* Bending of a tip held on a face: the tip is moved along the whisker's normal until it is back on the face. */
static struct nav_surface_seen face_at(const struct nav_surface_mount *m, double normal)
{
    double c = cos(m->yaw_rad), s = sin(m->yaw_rad), nx = cos(normal), ny = sin(normal);
    double x = m->base_m[0] + LENGTH * c, y = m->base_m[1] + LENGTH * s;
    double back = H(1e3 * LENGTH) / LENGTH / (-s * nx + c * ny);
    return (struct nav_surface_seen){nx * back, (-y * nx + x * ny) * back};
}

static void a_corner_is_told_with_its_radius(void **state)
{
    (void)state;
    struct nav_surface_mount m = mounted();
    for (double mm = 70.0; mm < 131.0; mm += 10.0) {
        struct nav_surface_seen seen = corner_at(&m, mm);
        struct nav_surface s;
        nav_surface_of(&m, &seen, &s);
        assert_true(s.face < 0.25);
        assert_near(s.radius_mm, mm, 3.0);
        assert_true(s.radius_sigma_mm < 10.0);
    }
}

static void a_whisker_may_stand_askew_to_its_arm(void **state)
{
    (void)state;
    struct nav_surface_mount m = mounted();
    m.yaw_rad += 0.6;
    struct nav_surface_seen seen = corner_at(&m, 100.0);
    struct nav_surface s;
    nav_surface_of(&m, &seen, &s);
    assert_near(s.radius_mm, 100.0, 4.0);
    assert_true(s.radius_sigma_mm < 10.0);
}

static void a_face_is_told_with_the_way_it_lies(void **state)
{
    (void)state;
    struct nav_surface_mount m = mounted();
    for (double normal = -0.2; normal < 0.61; normal += 0.2) {
        struct nav_surface_seen seen = face_at(&m, normal);
        struct nav_surface s;
        nav_surface_of(&m, &seen, &s);
        assert_true(s.face > 0.75);
        assert_near(s.normal_rad, normal, 0.06);
        assert_true(s.normal_sigma_rad < 0.2);
    }
}

static void noise_is_borne(void **state)
{
    (void)state;
    struct nav_surface_mount m = mounted();
    struct nav_surface_seen corner = corner_at(&m, 100.0), face = face_at(&m, 0.3);
    struct nav_surface s;
    for (double off = 0.93; off < 1.08; off += 0.07) {
        struct nav_surface_seen seen = {corner.per_metre * off, corner.per_radian / off};
        nav_surface_of(&m, &seen, &s);
        assert_true(s.face < 0.5);
        seen = (struct nav_surface_seen){face.per_metre * off, face.per_radian / off};
        nav_surface_of(&m, &seen, &s);
        assert_true(s.face > 0.5);
        assert_near(s.normal_rad, 0.3, 0.2);
    }
}

static void what_is_no_number_or_fits_nothing_is_open(void **state)
{
    (void)state;
    struct nav_surface_mount m = mounted();
    const struct nav_surface_seen none[] = {{(double)NAN, 1.0}, {1.0, INFINITY}, {0.0, 0.0}, {-1e9, 1e9}};
    for (int i = 0; i < 4; i++) {
        struct nav_surface s;
        nav_surface_of(&m, &none[i], &s);
        assert_true(isfinite(s.face) && isfinite(s.normal_rad) && isfinite(s.normal_sigma_rad));
        assert_true(isfinite(s.radius_mm) && isfinite(s.radius_sigma_mm));
        if (i < 2)
            assert_near(s.face, 0.5, 0.0);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_corner_is_told_with_its_radius),
        cmocka_unit_test(a_whisker_may_stand_askew_to_its_arm),
        cmocka_unit_test(a_face_is_told_with_the_way_it_lies),
        cmocka_unit_test(noise_is_borne),
        cmocka_unit_test(what_is_no_number_or_fits_nothing_is_open),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
