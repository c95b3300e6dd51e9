/* A grid map read out. */
#ifndef NAV_GRID_VIEW_H
#define NAV_GRID_VIEW_H

#include "grid_sense.h"
#include "mapper.h"

/* Stretches of cells in a row whose contacts lie on one line; as nav_mapper_faces. `room` of them are kept apart at
 * most. */
long nav_grid_view_faces(struct nav_grid, struct nav_mapper_face *out, long room);

/* The smallest grid that holds all cells of which something is known, and the probability of each; as nav_mapper_grid
 * and nav_mapper_occupancy. */
struct nav_mapper_grid nav_grid_view_cells(struct nav_grid);
void nav_grid_view_occupancy(struct nav_grid, float *out);

#endif
