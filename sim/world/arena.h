/* Geometry of the arena: floor tiles, walls on the boundary, boxes. Metres, arena frame. */
#ifndef SIM_ARENA_H
#define SIM_ARENA_H

#include <stdbool.h>
#include <stddef.h>

#include "sim_scene.h"

struct sim_point {
    double x, y;
};

/* Where a straight path first meets a box or a wall. */
struct sim_hit {
    double fraction;                         /* of the path, 0..1 */
    struct sim_point normal;                 /* unit vector into the box or wall */
    const struct sim_floor_texture *surface; /* of the face, as in sim_box */
};

/* Index of the tile under a point in scene->tile; beyond a wall of the nearest tile, over a box of the tile beneath. */
size_t sim_arena_tile(const struct sim_scene *scene, struct sim_point at);

/* Texture index of the tile under a point; beyond a wall that of the nearest tile, over a box that of the tile beneath.
 */
size_t sim_arena_texture(const struct sim_scene *scene, struct sim_point at);

/* Distance from a point to the nearest border of its tile, the walls included; 0 beyond a wall. */
double sim_arena_inside(const struct sim_scene *scene, struct sim_point at);

/* Casts a ray from one point to another; true if it meets a box or a wall, which hit then describes. A path that starts
 * inside a box or beyond a wall hits at once (fraction 0). */
bool sim_arena_ray(const struct sim_scene *scene, struct sim_point from, struct sim_point to, struct sim_hit *hit);

/* Distance from a point to the nearest wall or box, negative inside one. */
double sim_arena_clearance(const struct sim_scene *scene, struct sim_point at);

#endif
