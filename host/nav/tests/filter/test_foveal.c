/* The foveal filter by hand; its state is looked at, so its source is part of this program. */
#include "../filter/foveal.c"

#include <string.h>

#include "near.h"
#include "rooms.h"

static struct nav_problem quiet_room(void)
{
    struct nav_problem p = room();
    p.prior.mean = (struct nav_pose){0.36, 0.25, 0.0};
    p.prior.sigma[0] = p.prior.sigma[1] = 0.1;
    p.prior.sigma[2] = 0.3;
    return p;
}

static void the_fovea_is_eleven_cubed_over_a_quarter_metre_and_ninety_degrees(void **state)
{
    (void)state;
    struct nav_problem p = quiet_room();
    struct foveal *f = foveal_create(&p);
    assert_int_equal(foveal_points(f), 1331);
    f->belief.mean.theta = NAV_PI / 2.0; /* egocentric: ahead is up */
    struct nav_pose first = foveal_point(f, 0), last = foveal_point(f, 1330);
    assert_near(last.y - first.y, 0.25, 1e-12);
    assert_near(first.x - last.x, 0.25, 1e-12);
    assert_near(last.theta - first.theta, NAV_PI / 2.0, 1e-12);
    assert_near(foveal_point(f, 665).x, 0.36, 1e-12);
    foveal_destroy(f);
}

static void nothing_read_keeps_the_mode_and_fits_the_clipped_prior(void **state)
{
    (void)state;
    struct nav_problem p = quiet_room();
    p.prior.sigma[0] = p.prior.sigma[1] = 0.03;
    p.settings.foveal.quantum_m = 0.01;
    struct foveal *f = foveal_create(&p);
    const double none[] = {0.0, 0.0};
    foveal_update(f, &(struct nav_evidence){.reading = NULL, .weight = none});
    assert_near(f->belief.mean.x, 0.36, 1e-12);
    /* A Gaussian of 0.03 m sampled every 0.025 m keeps its variance; the quantisation term is added (equation 7). */
    assert_near(f->belief.covariance[0], 0.0009 + 0.0001, 2e-5);
    assert_near(f->belief.covariance[1], 0.0, 1e-9);
    foveal_destroy(f);
}

static void a_texture_moves_the_mode_to_the_nearest_point_that_fits(void **state)
{
    (void)state;
    struct nav_problem p = quiet_room();
    p.settings.texture.temper = 1.0;
    p.settings.texture.outlier = 1e-6;
    p.prior.sigma[2] = 0.05;
    struct foveal *f = foveal_create(&p);
    const double right_tile[] = {-50.0, 0.0}, weight[] = {1.0, 0.0};
    const double *reading[] = {right_tile, NULL};
    foveal_update(f, &(struct nav_evidence){.reading = reading, .weight = weight});
    /* Tip 0.1 ahead, border at 0.5: the centre is at 0.4 or beyond; points lie at 0.36, 0.385, 0.41. */
    assert_near(f->belief.mean.x, 0.41, 1e-12);
    assert_near(f->belief.mean.y, 0.25, 1e-12);
    assert_near(f->belief.mean.theta, 0.0, 1e-12);
    foveal_destroy(f);
}

static void it_never_looks_outside_the_fovea(void **state)
{
    (void)state;
    struct nav_problem p = quiet_room();
    p.prior.mean.x = 0.2; /* the tip's border is 0.2 m ahead, outside the fovea's 0.125 */
    p.settings.texture.temper = 1.0;
    struct foveal *f = foveal_create(&p);
    const double right_tile[] = {-50.0, 0.0}, weight[] = {1.0, 0.0};
    const double *reading[] = {right_tile, NULL};
    foveal_update(f, &(struct nav_evidence){.reading = reading, .weight = weight});
    assert_near(f->belief.mean.x, 0.2, 0.126);
    foveal_destroy(f);
}

static void a_fovea_wholly_inside_a_solid_changes_nothing(void **state)
{
    (void)state;
    struct nav_problem p = quiet_room();
    p.prior.mean = (struct nav_pose){5.0, 5.0, 0.0};
    struct foveal *f = foveal_create(&p);
    const double right_tile[] = {-50.0, 0.0}, weight[] = {1.0, 0.0};
    const double *reading[] = {right_tile, NULL};
    foveal_update(f, &(struct nav_evidence){.reading = reading, .weight = weight});
    assert_near(f->belief.mean.x, 5.0, 0.0);
    assert_near(f->belief.covariance[0], 0.01, 1e-12);
    foveal_destroy(f);
}

/* The covariance after one row that says tile 0 or tile 1. */
static void covariance_after(struct nav_problem *p, bool right, double covariance[9])
{
    p->settings.texture.temper = 1.0;
    struct foveal *f = foveal_create(p);
    const double left_tile[] = {0.0, -50.0}, right_tile[] = {-50.0, 0.0}, weight[] = {1.0, 0.0};
    const double *reading[] = {right ? right_tile : left_tile, NULL};
    foveal_update(f, &(struct nav_evidence){.reading = reading, .weight = weight});
    memcpy(covariance, f->belief.covariance, sizeof f->belief.covariance);
    foveal_destroy(f);
}

static void inflation_puts_the_fovea_in_place_of_the_posterior(void **state)
{
    (void)state;
    struct nav_problem p = quiet_room();
    p.settings.foveal.inflate = 1.0;
    double left[9], right[9];
    covariance_after(&p, false, left);
    covariance_after(&p, true, right);
    assert_near(left[0], 10.0 * 0.025 * 0.025 + 0.0001, 1e-12); /* variance of -5 .. 5 is 10 */
    assert_near(left[1], 0.0, 0.0);
    assert_memory_equal(left, right, sizeof left);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_fovea_is_eleven_cubed_over_a_quarter_metre_and_ninety_degrees),
        cmocka_unit_test(nothing_read_keeps_the_mode_and_fits_the_clipped_prior),
        cmocka_unit_test(a_texture_moves_the_mode_to_the_nearest_point_that_fits),
        cmocka_unit_test(it_never_looks_outside_the_fovea),
        cmocka_unit_test(a_fovea_wholly_inside_a_solid_changes_nothing),
        cmocka_unit_test(inflation_puts_the_fovea_in_place_of_the_posterior),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
