/* Mapping by Rao-Blackwellised particles with grid maps: FastSLAM 2.0's way, for whiskers. A pose is drawn where a
 * whisker touches; until then a particle goes on as a Gaussian, so that the draw chooses among all errors since the
 * last contact. */
#ifndef NAV_GRID_MAPPER_H
#define NAV_GRID_MAPPER_H

#include "mapper.h"

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

/* cffi: begin */
struct nav_grid_mapper;

struct nav_grid_mapper_options {
    int particles; /* 1 to 5 000 */
    bool surface;  /* poses are proposed where contacts lie on the map's surfaces, too; else by the odometry alone */
};

/* The options' defaults. */
struct nav_grid_mapper_options nav_grid_mapper_default(void);

/* As nav_mapper_new. NULL: no memory, or options out of range. */
struct nav_grid_mapper *nav_grid_mapper_new(const struct nav_problem *, const struct nav_grid_mapper_options *);
void nav_grid_mapper_free(struct nav_grid_mapper *);

/* As nav_mapper_step and nav_mapper_replay. */
void nav_grid_mapper_step(struct nav_grid_mapper *, const struct nav_row *, struct nav_estimate *);
void nav_grid_mapper_replay(struct nav_grid_mapper *, const struct nav_rows *, long first, long count,
                            struct nav_estimate *out, double *step_us);

/* Log-likelihood of all rows up to the last contact. */
double nav_grid_mapper_evidence(const struct nav_grid_mapper *);

/* The likeliest particle's map, as nav_mapper_faces (at most NAV_GRID_FACES_MOST), nav_mapper_grid,
 * nav_mapper_occupancy. */
enum { NAV_GRID_FACES_MOST = 2000 };
long nav_grid_mapper_faces(const struct nav_grid_mapper *, struct nav_mapper_face *out, long room);
struct nav_mapper_grid nav_grid_mapper_grid(const struct nav_grid_mapper *);
void nav_grid_mapper_occupancy(const struct nav_grid_mapper *, float *out);

uint64_t nav_grid_mapper_bad_cells(const struct nav_grid_mapper *);
uint64_t nav_grid_mapper_bad_rows(const struct nav_grid_mapper *);
/* cffi: end */

#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif
