/* The known world: tiles, boxes, walls, and what each whisker would meet at a pose. */
#ifndef NAV_ARENA_H
#define NAV_ARENA_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "pose.h"

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

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
    const uint8_t *floor;  /* texture index, [rows][columns], row 0 has the smallest y; `classes` and more: not known */
    int classes;           /* number of textures */
    int boxes;
    const struct nav_box *box;
    int unknown; /* the last so many boxes are ground that was never mapped: the robot may stand there, and nobody
                    knows what a whisker meets there */
};

/* Where a texture whisker's tip drags, robot frame, m. */
struct nav_tip {
    double x, y;
};

/* An object whisker: straight from its base, robot frame, m and rad. */
struct nav_ray {
    double x, y, yaw, length;
};

/* A sensor of the user's own. A pose leads one to expect one of a few codes of it, and a reading has a likelihood by
 * code: that is all a filter needs. Functions get `self`, which outlives the filter, and must not block. */
struct nav_sensor {
    int values;       /* doubles in a reading, at least 1 */
    int codes;        /* 1 .. 255 */
    double spacing_m; /* a reading counts in full after so much travel since the last one; 0: each does */
    double detail_m;  /* over which what is expected changes; cells are half as wide. 0: not given */
    /* Code expected at a pose of the robot; outside 0 .. codes - 1: nothing is known there. */
    int (*expect)(const void *self, double x, double y, double theta);
    /* likelihood[codes]: p(reading | code) in any unit. One that is not finite, or negative, or none above 0: the
     * reading is counted as a bad cell and left out. */
    void (*fill)(const void *self, const double *reading, double *likelihood);
    const void *self;
};

/* A sensor that expects what a map of codes holds under its place, and whose reading is the log-likelihood of each code
 * (values = codes): `self` of the two functions below. */
struct nav_sensor_map {
    int codes;
    double x, y;         /* of the sensor in the robot's frame, m */
    double cell;         /* edge of a cell, m */
    int columns, rows;   /* the map's lower left corner is the world's origin */
    const uint8_t *code; /* [rows][columns]; codes and more, and beyond the map: not known */
};

int nav_sensor_map_expect(const void *map, double x, double y, double theta);
void nav_sensor_map_fill(const void *map, const double *reading, double *likelihood);

struct nav_robot {
    double body_radius;       /* m */
    double odometry_relative; /* standard deviation of a straight line's or a turn's relative error */
    double radial_sigma;      /* m */
    int tips;
    const struct nav_tip *tip;
    int rays;
    const struct nav_ray *ray;
    bool normals; /* rows carry directions of the surfaces that object whiskers touch */
    int sensors;
    const struct nav_sensor *sensor;
    double odometry_turn; /* standard deviation of a row's turn, rad, as a gyroscope measures it; 0: the relative one */
};

/* Number of the tile under (x, y), of the nearest beyond a wall. */
int nav_arena_tile(const struct nav_arena *, double x, double y);

/* Texture index under (x, y); beyond a wall that of the nearest tile, over an obstacle that of the tile beneath. */
int nav_arena_texture(const struct nav_arena *, double x, double y);

/* Distance from (x, y) along `heading` to the first wall or box, m; INFINITY when it exceeds `reach`, 0 when (x, y) is
 * itself in a box or beyond a wall; NaN when the way leads through ground never mapped first. */
double nav_arena_range(const struct nav_arena *, double x, double y, double heading, double reach);

/* Gives the same distance along the unit vector (c, s). */
double nav_arena_range_along(const struct nav_arena *, double x, double y, double c, double s, double reach);

/* Whether a round body centred on (x, y) stands clear of walls and boxes; ground never mapped is clear. */
bool nav_arena_free(const struct nav_arena *, double x, double y, double radius);
/* cffi: end */

#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif
