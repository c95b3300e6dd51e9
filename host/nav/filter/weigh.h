/* The library's likelihood and motion noise for filters that are not the library's own: rows in, weights of poses out.
 */
#ifndef NAV_WEIGH_H
#define NAV_WEIGH_H

#include "filter.h"

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

/* cffi: begin */
struct nav_weigher;

/* The problem and its arrays must outlive it. blur_m: spread of a pose, see nav_likelihood_new; 0 for particles. NULL:
 * no memory. */
struct nav_weigher *nav_weigher_new(const struct nav_problem *, double blur_m);
void nav_weigher_free(struct nav_weigher *);

/* Takes one row as nav_filter_step does. motion[5]: x, y (m) and theta (rad) in the robot's frame before the row, then
 * the standard deviations of position (m, per axis) and heading (rad). True when something new was read. */
bool nav_weigher_take(struct nav_weigher *, const struct nav_row *, double motion[5]);

/* Log-likelihood of that row at n poses, [n][3] x, y, theta; -INFINITY where the robot cannot stand, 0 at other poses
 * when nothing new was read. */
void nav_weigher_weigh(const struct nav_weigher *, const double *poses, long n, double *loglik);

/* The most that the row's log-likelihood can be at any pose. */
double nav_weigher_ceiling(const struct nav_weigher *);
/* cffi: end */

#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif
