/* The demo's robot in an arena of choice. Include cmocka's headers first. */
#ifndef SIM_TEST_ROBOT_H
#define SIM_TEST_ROBOT_H

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "near.h"
#include "sim_world.h"
#include "whisker_constants.h"

#define ROBOT_ARM 0.16 /* m, centre to the base of an object whisker; the whisker is perpendicular to it */

/* Object whisker with its tip at this angle of the robot frame; side +1: base further left, -1: further right. */
static inline struct sim_whisker object_whisker(const char *name, double tip_deg, int side)
{
    struct sim_whisker whisker = {.role = SIM_OBJECT_WHISKER, .length_m = SIM_WHISKER_OUTSIDE_M};
    double angle = tip_deg * SIM_DEGREE + side * atan(SIM_WHISKER_OUTSIDE_M / ROBOT_ARM);
    strcpy(whisker.name, name);
    whisker.x = ROBOT_ARM * cos(angle);
    whisker.y = ROBOT_ARM * sin(angle);
    whisker.yaw = angle - side * SIM_PI / 2;
    return whisker;
}

static inline struct sim_whisker texture_whisker(const char *name, double x, double y)
{
    struct sim_whisker whisker = {.role = SIM_TEXTURE_WHISKER, .x = x, .y = y};
    strcpy(whisker.name, name);
    return whisker;
}

/* Lanes 0..3: object whiskers from left to right; 4, 5: texture whiskers, left and right. */
static inline void mount_robot(struct sim_scene *scene)
{
    scene->body_radius = 0.165;
    scene->whiskers = 6;
    scene->whisker[0] = object_whisker("left_outer", 60, 1);
    scene->whisker[1] = object_whisker("left_inner", 20, 1);
    scene->whisker[2] = object_whisker("right_inner", -20, -1);
    scene->whisker[3] = object_whisker("right_outer", -60, -1);
    scene->whisker[4] = texture_whisker("left_floor", -0.02, 0.21);
    scene->whisker[5] = texture_whisker("right_floor", -0.02, -0.21);
}

/* A square arena with walls this far apart, one tile of vinyl, the robot at a pose, no boxes yet. */
static inline struct sim_scene bench(double side_m, double x, double y, double theta)
{
    struct sim_scene scene = {.size_x = side_m, .size_y = side_m, .tile_m = side_m, .textures = 1};
    strcpy(scene.texture[0], "VINYL");
    scene.columns = scene.rows = 1;
    scene.start = (struct sim_pose){x, y, theta};
    mount_robot(&scene);
    return scene;
}

#endif
