/* How well a path explains rows: the evidence by which mappers of any kind are compared. Each row is predicted from a
 * grid map of the rows before it, as that path places them, so all are judged by the same densities of the same
 * readings, and none by its own account. */
#ifndef NAV_GRID_PATH_H
#define NAV_GRID_PATH_H

#include "replay.h"

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

/* cffi: begin */
struct nav_grid_path;

/* A path from the origin, of which nothing is known. The problem must outlive it. NULL: no memory. */
struct nav_grid_path *nav_grid_path_new(const struct nav_problem *);
void nav_grid_path_free(struct nav_grid_path *);

/* Takes a row and where a mapper says that the robot is after it. Returns the row's log-likelihood given those before
 * it, at the pose before it moved on by its odometry; as nav_grid_mapper_evidence counts it. Does not allocate. */
double nav_grid_path_step(struct nav_grid_path *, const struct nav_row *, const struct nav_pose *);

/* Steps through rows first .. first + count - 1, found[count] by a mapper's replay: out[count] of log-likelihoods. */
void nav_grid_path_replay(struct nav_grid_path *, const struct nav_rows *, long first, long count,
                          const struct nav_estimate *found, double *out);

/* Memory, all of it taken by nav_grid_path_new. */
size_t nav_grid_path_bytes(const struct nav_grid_path *);
/* cffi: end */

#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif
