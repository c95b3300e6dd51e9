/* Replaying rows is stepping through them. */
#include "replay.h"

#include <math.h>
#include <string.h>

#include "near.h"
#include "rooms.h"

enum { ROWS = 6 };

static void replay_gives_what_steps_give(void **state)
{
    (void)state;
    struct nav_problem p = room();
    double t[ROWS], odometry[3 * ROWS], texture[2 * ROWS], radial[ROWS], us[ROWS];
    for (int k = 0; k < ROWS; k++) {
        t[k] = 0.1 * (k + 1);
        memcpy(odometry + 3 * k, (double[]){0.01, 0.0, 0.02 * k}, 3 * sizeof *odometry);
        memcpy(texture + 2 * k, (double[]){0.0, -1.0 * k}, 2 * sizeof *texture);
        radial[k] = k % 2 ? 0.15 : (double)INFINITY;
    }
    const struct nav_rows rows = {t, odometry, texture, radial, NULL, NULL, 2, 1, 0};
    struct nav_filter *one = nav_filter_new("grid", &p), *other = nav_filter_new("grid", &p);
    struct nav_estimate parts[ROWS], whole[ROWS];
    nav_replay(one, &rows, 0, 2, parts, us);
    nav_replay(one, &rows, 2, ROWS - 2, parts + 2, us + 2);
    for (int k = 0; k < ROWS; k++) {
        struct nav_row row = {.t_s = t[k], .texture = texture + 2 * k, .radial_m = radial + k};
        memcpy(row.odometry, odometry + 3 * k, sizeof row.odometry);
        nav_filter_step(other, &row, &whole[k]);
        assert_memory_equal(&parts[k].pose, &whole[k].pose, sizeof whole[k].pose);
        assert_true(us[k] >= 0.0 && us[k] < 1e7);
    }
    nav_filter_free(one);
    nav_filter_free(other);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(replay_gives_what_steps_give)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
