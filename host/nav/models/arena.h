/* The known world: tiles, boxes, walls, and what each whisker would meet at a pose. */
#ifndef NAV_ARENA_H
#define NAV_ARENA_H

#include <stdbool.h>
#include <stdint.h>

#include "pose.h"

/* cffi: begin */
/* A solid box standing on the floor, m. */
struct nav_box {
    double x0, y0, x1, y1;
};

/* Walls stand on the boundary of 0 .. size. The caller owns the arrays. */
struct nav_arena {
    double size_x, size_y; /* m */
    double tile;           /* m */
    int columns, rows;     /* of tiles */
    const uint8_t *floor;  /* texture index, [rows][columns], row 0 has the smallest y */
    int classes;           /* number of textures */
    int boxes;
    const struct nav_box *box;
};

/* Where a texture whisker's tip drags, robot frame, m. */
struct nav_tip {
    double x, y;
};

/* An object whisker: straight from its base, robot frame, m and rad. */
struct nav_ray {
    double x, y, yaw, length;
};

struct nav_robot {
    double body_radius;       /* m */
    double odometry_relative; /* standard deviation of a straight line's or a turn's relative error */
    double radial_sigma;      /* m */
    int tips;
    const struct nav_tip *tip;
    int rays;
    const struct nav_ray *ray;
};

/* Texture index under (x, y); beyond a wall that of the nearest tile, over an obstacle that of the tile beneath. */
int nav_arena_texture(const struct nav_arena *, double x, double y);

/* Distance from (x, y) along `heading` to the first wall or box, m; INFINITY when it exceeds `reach`, 0 when (x, y) is
 * itself in a box or beyond a wall. */
double nav_arena_range(const struct nav_arena *, double x, double y, double heading, double reach);

/* The same along the unit vector (c, s). */
double nav_arena_range_along(const struct nav_arena *, double x, double y, double c, double s, double reach);

/* Whether a round body centred on (x, y) stands clear of walls and boxes. */
bool nav_arena_free(const struct nav_arena *, double x, double y, double radius);
/* cffi: end */

#endif
