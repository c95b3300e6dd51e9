/* The scene a world is made of: arena, floor, obstacles, robot and start pose, read from a flat text file.
 *
 * One item a line, '#' starts a comment, lengths in metres, angles in radians, anticlockwise:
 *
 *   size_m X Y                                arena from (0, 0) to (X, Y); walls stand on the boundary
 *   tile_m T                                  side of a square floor tile
 *   texture NAME                              repeated, one of mech_floor.h; its first letter stands for it
 *   floor LETTERS                             repeated: one row of tiles, rows from the largest y to the smallest
 *   wall NAME                                 texture of the walls' faces, one of mech_floor.h; left out: none, smooth
 *   obstacle X0 Y0 X1 Y1 [NAME]               repeated: a box from its smallest corner to its largest, and the texture
 *                                             of its faces as of walls
 *   body_radius_m R
 *   texture_whisker NAME X Y                  tip in the robot frame (x forward, y left)
 *   object_whisker NAME X Y YAW LENGTH        base and direction in the robot frame
 *   start X Y THETA
 *   mechanics LEVEL                           how whiskers bend (enum sim_mechanics, below); left out: static
 *   sensor NAME                               what reads the magnets (enum sim_sensor); left out: mlx90333
 *   batch N                                   which whiskers of their kind the robot has: they differ by this number
 *
 * The whiskers in the order of the file are lanes 0, 1, ... Strict checks of what a person writes (TOML) are not
 * made here: this is what a program writes, and anything unexpected is refused with one line.
 */
#ifndef SIM_SCENE_H
#define SIM_SCENE_H

#include <stddef.h>
#include <stdint.h>

/* cffi: begin */
enum {
    SIM_NAME_SIZE = 32, /* bytes of a name, its terminator included */
    SIM_TEXTURES_MAX = 26,
    SIM_TILES_MAX = 4096,
    SIM_OBSTACLES_MAX = 64,
    SIM_WHISKERS_MAX = 28
};

enum sim_role { SIM_TEXTURE_WHISKER, SIM_OBJECT_WHISKER };

/* How whiskers bend: levels of mech_whisker.h. static: closed form with the plug; modes: large deflection, friction,
 * slip-off and vibration. A dragged tip has no large deflection of its own. */
enum sim_mechanics { SIM_MECHANICS_STATIC = 0, SIM_MECHANICS_MODES = 3 };

/* What noise a reading has: a node's sensor, or the Pico's at 2 kHz (sensor_noise.c). */
enum sim_sensor { SIM_SENSOR_MLX90333, SIM_SENSOR_TMAG5170 };

struct sim_pose {
    double x, y, theta; /* m, m, rad */
};

struct sim_floor_texture; /* mech_floor.h */

struct sim_box {
    double x0, y0, x1, y1;                   /* m */
    const struct sim_floor_texture *surface; /* of its faces; NULL: smooth */
};

struct sim_whisker {
    char name[SIM_NAME_SIZE];
    enum sim_role role;
    double x, y;     /* robot frame, m: the tip of a texture whisker, the base of an object whisker */
    double yaw;      /* object whisker: direction from base to tip, rad */
    double length_m; /* object whisker */
};

struct sim_scene {
    double size_x, size_y, tile_m;
    size_t textures;
    char texture[SIM_TEXTURES_MAX][SIM_NAME_SIZE];
    size_t columns, rows;
    unsigned char tile[SIM_TILES_MAX]; /* texture index of tile (column, row) at row * columns + column; row 0: y = 0 */
    const struct sim_floor_texture *wall; /* surface of the walls; NULL: smooth */
    size_t obstacles;
    struct sim_box obstacle[SIM_OBSTACLES_MAX];
    double body_radius;
    size_t whiskers;
    struct sim_whisker whisker[SIM_WHISKERS_MAX];
    struct sim_pose start;
    struct sim_pose origin; /* of the arena's frame on the map, in which poses are reported */
    enum sim_mechanics mechanics;
    enum sim_sensor sensor;
    uint32_t batch;
};

/* A pose of the arena's frame on the map. */
struct sim_pose sim_scene_on_map(const struct sim_scene *scene, struct sim_pose pose);

/* Reads a scene from text. Returns 0, or -1 with one line in error that names the source, the line and the remedy. */
int sim_scene_parse(const char *text, const char *source, struct sim_scene *scene, char *error, size_t error_size);

/* Reads a scene from the file at path. Returns 0, or -1 with one line in error. */
int sim_scene_read(const char *path, struct sim_scene *scene, char *error, size_t error_size);
/* cffi: end */

#endif
