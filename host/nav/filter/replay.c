#define _POSIX_C_SOURCE 200809L /* clock_gettime */

#include "replay.h"

#include <time.h>

static double replay_now_us(void)
{
    struct timespec t = {0, 0};
    (void)clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return (double)t.tv_sec * 1e6 + (double)t.tv_nsec * 1e-3;
}

struct nav_row nav_rows_at(const struct nav_rows *rows, long at)
{
    const double *odometry = rows->odometry + 3 * at;
    return (struct nav_row){.t_s = rows->t_s[at],
                            .odometry = {odometry[0], odometry[1], odometry[2]},
                            .texture = rows->texture + at * rows->texture_width,
                            .radial_m = rows->radial_m + at * rows->radial_width,
                            .normal = rows->normal ? rows->normal + 2 * at * rows->radial_width : NULL,
                            .own = rows->own ? rows->own + at * rows->own_width : NULL};
}

void nav_replay_steps(nav_step *step, void *estimator, const struct nav_rows *rows, long first, long count,
                      struct nav_estimate *out, double *step_us)
{
    for (long k = 0; k < count; k++) {
        struct nav_row row = nav_rows_at(rows, first + k);
        double begun = replay_now_us();
        step(estimator, &row, &out[k]);
        step_us[k] = replay_now_us() - begun;
    }
}

static void replay_filter(void *filter, const struct nav_row *row, struct nav_estimate *out)
{
    nav_filter_step(filter, row, out);
}

void nav_replay(struct nav_filter *filter, const struct nav_rows *rows, long first, long count,
                struct nav_estimate *out, double *step_us)
{
    nav_replay_steps(replay_filter, filter, rows, first, count, out, step_us);
}
