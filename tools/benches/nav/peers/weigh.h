/* The library's likelihood and motion noise for filters of other projects: rows in, weights of poses out. */
#ifndef PEER_WEIGH_H
#define PEER_WEIGH_H

#include "filter.h"

struct nav_weigher;

/* The problem and its arrays must outlive it. NULL: no memory. */
struct nav_weigher *nav_weigher_new(const struct nav_problem *);
void nav_weigher_free(struct nav_weigher *);

/* Takes one row as nav_filter_step does. motion[5]: x, y (m) and theta (rad) in the robot's frame before the row, then
 * the standard deviations of position (m, per axis) and heading (rad). True when something new was read. */
bool nav_weigher_take(struct nav_weigher *, const struct nav_row *, double motion[5]);

/* Log-likelihood of that row at n poses, [n][3] x, y, theta; -INFINITY where the robot cannot stand, 0 at other poses
 * when nothing new was read. */
void nav_weigher_weigh(const struct nav_weigher *, const double *poses, long n, double *loglik);

/* The most that the row's log-likelihood can be at any pose. */
double nav_weigher_ceiling(const struct nav_weigher *);

#endif
