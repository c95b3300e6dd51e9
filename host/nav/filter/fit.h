/* How well readings fit the map at a filter's answers: what the readings say for the map, and what the model of the
 * sensors would have them say if map and motion were right.
 *
 * A reading says log(p(reading | answer) / p(reading | sensor broken)) for its sensor's map, in nats; the answer stands
 * for poses by its covariance. What it should say is the mean of that over readings drawn from the same model at the
 * same poses, and its spread that of the draws: the limit of what is ordinary follows from the model. */
#ifndef NAV_FIT_H
#define NAV_FIT_H

#include "replay.h"

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

/* cffi: begin */
/* Sums over rows, of one sensor. */
struct nav_fit {
    double readings;            /* weighted by what is new in each */
    double said, due, variance; /* nats, of `said` about `due` nats^2 */
};

/* Adds rows 0 .. count - 1 whose answered[count] are sure to out[room]: texture whiskers, then object whiskers. 0; -1
 * without memory. */
int nav_fit_add(const struct nav_problem *, const struct nav_rows *, const struct nav_estimate *answered, long count,
                struct nav_fit *out, long room);
/* cffi: end */

#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif
