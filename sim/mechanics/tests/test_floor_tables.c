#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "mech_drag.h"
#include "near.h"

/* Whisker physics, section 7: ranges of the classes; weaves and friction drops are single values there. */
static void test_classes(void **state)
{
    (void)state;
    const struct {
        double rms[2], correlation[2], wavelength, amplitude, drop;
    } wanted[] = {
        {{0.03, 0.08}, {5, 5}, 0, 0, 0.05}, {{0.2, 0.4}, {1, 2}, 3, 0.15, 0.10}, {{0.6, 1.2}, {2, 4}, 6, 0.4, 0.15}};
    assert_int_equal(SIM_FLOOR_TEXTURE_COUNT, COUNT(wanted));
    for (size_t i = 0; i < COUNT(wanted); i++) {
        const struct sim_floor_texture *floor = &SIM_FLOOR_TEXTURES[i];
        assert_true(floor->rms_mm >= wanted[i].rms[0] && floor->rms_mm <= wanted[i].rms[1]);
        assert_true(floor->correlation_mm >= wanted[i].correlation[0] &&
                    floor->correlation_mm <= wanted[i].correlation[1]);
        assert_near(floor->weave_wavelength_mm, wanted[i].wavelength, 0);
        assert_near(floor->weave_amplitude_mm, wanted[i].amplitude, 0);
        assert_near(floor->friction_drop, wanted[i].drop, 0);
    }
}

/* Independent samples in a window of 100 ms: variance of the height over variance of a window's mean. */
static double independent(double correlation_mm, double speed)
{
    enum { WINDOW = 200, WINDOWS = 6000 };
    const struct sim_floor_texture floor = {"PLAIN", 1, correlation_mm, 0, 0, 0, false};
    struct mech_floor profile;
    double square = 0, square_of_means = 0;
    mech_floor_start(&profile, &floor, sim_rng_stream(9, 9, (uint32_t)(1000 * correlation_mm * speed)));
    for (int n = 0; n < WINDOWS; n++) {
        double sum = 0;
        for (int i = 0; i < WINDOW; i++) {
            mech_floor_move(&profile, &floor, speed * TICK);
            double z = mech_floor_height(&profile, &floor);
            sum += z / WINDOW;
            square += z * z / WINDOW / WINDOWS;
        }
        square_of_means += sum * sum / WINDOWS;
        mech_floor_move(&profile, &floor, 5e-3 * correlation_mm); /* the next window knows nothing of this one */
    }
    return square / square_of_means;
}

/* The table's effective numbers, 10.8 to 1.7 of 200 samples; its 6.5 (2 mm, 0.2 m/s) is not what the autocorrelation's
 * integral x^2/(2 (x - 1 + exp(-x))) gives, x lengths of correlation in a window, and is left out. */
static void test_samples_are_not_independent(void **state)
{
    (void)state;
    const struct {
        double correlation_mm, slow, fast; /* at 0.1 and 0.2 m/s */
    } table[] = {{0.5, 10.8, 21}, {2, 3.0, 0}, {5, 1.7, 2.7}};
    for (size_t i = 0; i < COUNT(table); i++) {
        for (int fast = 0; fast < 2; fast++) {
            double speed = fast ? 0.2 : 0.1, listed = fast ? table[i].fast : table[i].slow;
            double x = 1e3 * speed * 0.1 / table[i].correlation_mm, exact = x * x / (2 * (x - 1 + exp(-x)));
            assert_share(independent(table[i].correlation_mm, speed), exact, 0.1);
            assert_true(listed == 0 || fabs(exact / listed - 1) < 0.06);
        }
    }
}

/* A pre-tilted whisker is let go sooner by a pile, (R - behind)/v, and one that already stands straight is not held at
 * all. */
static void test_pretilt_shortens_hooks(void **state)
{
    (void)state;
    const double share[] = {0, 0.25, 0.5, 0.75, 0.95};
    double before = 1e9;
    for (size_t i = 0; i < COUNT(share); i++) {
        struct mech_whisker w = mech_whisker_default();
        struct mech_stance stance = mech_stance_default();
        struct mech_drag drag;
        struct sim_floor_texture pile = SIM_FLOOR_TEXTURES[0], *floor = &pile;
        pile.pile = true;
        double reach = mech_drag_reach(&w, &stance);
        int held = 0;
        stance.behind = share[i] * reach;
        mech_drag_start(&drag, &w, &stance, floor, sim_rng_stream(1, 2, 3), MECH_VIBRATION, TICK);
        for (int k = 0; k < 4000; k++) {
            struct mech_stroke stroke = {0.15 * TICK, k > 300 ? 1e-3 : 0, 0};
            mech_drag_step(&drag, floor, &stroke);
            held += drag.contact == MECH_HOOKED;
        }
        assert_near(held * TICK, (1 - share[i]) * reach / 0.15, 2.5e-3 / 0.15);
        assert_true(held * TICK < before);
        before = held * TICK;
    }
    assert_true(before < 0.06);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_classes),
        cmocka_unit_test(test_samples_are_not_independent),
        cmocka_unit_test(test_pretilt_shortens_hooks),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
