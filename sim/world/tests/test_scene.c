#define _POSIX_C_SOURCE 200809L /* mkstemp */

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <stdlib.h>
#include <unistd.h>

#include "mech_floor.h"
#include "robot.h"

#define GOOD                                                                                                           \
    "# a comment\n"                                                                                                    \
    "size_m 1.0 0.9\n"                                                                                                 \
    "tile_m 0.5   # half a metre\n"                                                                                    \
    "texture VINYL\n"                                                                                                  \
    "texture ROUGH\n"                                                                                                  \
    "floor VR\n"                                                                                                       \
    "floor RR\n"                                                                                                       \
    "obstacle 0.5 0.5 1 0.9\n"                                                                                         \
    "body_radius_m 0.165\n"                                                                                            \
    "texture_whisker left -0.02 0.21\n"                                                                                \
    "object_whisker front 0.1 0.12 -0.5 0.14\n"                                                                        \
    "start 0.25 0.25 0.1\n"

static struct sim_scene scene;
static char error[200];

static int parse(const char *text)
{
    error[0] = '\0';
    return sim_scene_parse(text, "test.scene", &scene, error, sizeof error);
}

static void test_good_scene(void **state)
{
    (void)state;
    assert_int_equal(parse(GOOD), 0);
    assert_near(scene.size_y, 0.9, 0);
    assert_int_equal(scene.textures, 2);
    /* The first row of letters has the largest y. */
    assert_memory_equal(scene.tile, ((unsigned char[]){1, 1, 0, 1}), 4);
    assert_int_equal(scene.obstacles, 1);
    assert_int_equal(scene.whiskers, 2);
    assert_int_equal(scene.whisker[0].role, SIM_TEXTURE_WHISKER);
    assert_string_equal(scene.whisker[1].name, "front");
    assert_near(scene.whisker[1].length_m, 0.14, 0);
    assert_near(scene.start.theta, 0.1, 0);
}

static void test_poses_are_reported_on_the_map(void **state)
{
    (void)state;
    struct sim_pose pose = {0.5, 0.25, 3.0};
    assert_int_equal(parse(GOOD), 0);
    struct sim_pose same = sim_scene_on_map(&scene, pose);
    assert_memory_equal(&same, &pose, sizeof pose); /* without an origin the map is the arena */
    assert_int_equal(parse(GOOD "origin -10 -3 1.5707963267948966\n"), 0);
    struct sim_pose reported = sim_scene_on_map(&scene, pose);
    assert_near(reported.x, -10.25, 1e-12);
    assert_near(reported.y, -2.5, 1e-12);
    assert_near(reported.theta, 3.0 - 1.5 * 3.14159265358979324, 1e-12);
}

static void test_mechanics_sensor_and_batch(void **state)
{
    (void)state;
    assert_int_equal(parse(GOOD), 0);
    assert_int_equal(scene.mechanics, SIM_MECHANICS_STATIC);
    assert_int_equal(scene.sensor, SIM_SENSOR_MLX90333);
    assert_int_equal(parse(GOOD "mechanics modes\nbatch 7\nsensor tmag5170\n"), 0);
    assert_int_equal(scene.sensor, SIM_SENSOR_TMAG5170);
    assert_int_equal(scene.mechanics, SIM_MECHANICS_MODES);
    assert_int_equal(scene.batch, 7);
}

static void test_faces_may_have_textures(void **state)
{
    (void)state;
    assert_int_equal(parse(GOOD), 0);
    assert_null(scene.wall);
    assert_null(scene.obstacle[0].surface);
    assert_int_equal(parse(GOOD "wall SMOOTH\nobstacle 0 0.5 0.1 0.6 ROUGH\n"), 0);
    assert_string_equal(scene.wall->name, "SMOOTH");
    assert_null(scene.obstacle[0].surface);
    assert_string_equal(scene.obstacle[1].surface->name, "ROUGH");
}

static void test_blanks_do_not_matter(void **state)
{
    (void)state;
    assert_int_equal(parse("\r\n\n \t# only this\n" GOOD "\n   "), 0);
}

/* What is appended to or put before a good scene, and what the refusal has to say. */
static const struct {
    const char *before, *after, *says;
} BAD[] = {
    {"", "wallpaper 1 2\n", "test.scene:13: unknown item 'wallpaper'"},
    {"", "wall GRASS\n", "wall: no texture is called 'GRASS'"},
    {"", "wall VINYL ROUGH\n", "wall: 2 values; must be 1"},
    {"", "obstacle 0 0 1 1 GRASS\n", "obstacle: no texture is called 'GRASS'"},
    {"", "obstacle 0 0 1 1 VINYL 1\n", "obstacle: 6 values; must be 4"},
    {"", "mechanics soft\n", "mechanics: 'soft'; use static or modes"},
    {"", "sensor hall\n", "sensor: 'hall'; use mlx90333 or tmag5170"},
    {"", "batch -1\n", "batch: -1; give a whole number"},
    {"", "batch 1.5\n", "batch: 1.5; give a whole number"},
    {"", "tile_m\n", "test.scene:13: tile_m: 0 values; must be 1"},
    {"", "tile_m 1 2\n", "tile_m: 2 values; must be 1"},
    {"", "tile_m one\n", "'one' is not a number"},
    {"", "tile_m 1.5x\n", "'1.5x' is not a number"},
    {"", "tile_m nan\n", "'nan' is not a number"},
    {"", "tile_m 0\n", "tile_m: 0; must be above 0"},
    {"", "size_m -1 1\n", "size_m: -1; must be above 0"},
    {"", "size_m 2 2\n", "do not cover 2 m x 2 m"},
    {"", "floor VRR\n", "row of 3 tiles after rows of 2"},
    {"", "floor RR\n", "floor: 3 rows of 2 tiles"},
    {"", "texture GRASS\n", "no floor is called 'GRASS'"},
    {"", "texture VINYL\n", "start with the same letter"},
    {"", "obstacle 1 1 0 0\n", "smallest corner first"},
    {"", "object_whisker far 0 0 0 0.2\n", "length 0.2 m"},
    {"", "object_whisker left 0 0 0 0.1\n", "a second whisker called 'left'"},
    {"", "texture_whisker a-name-of-many-more-characters-than-fit 0 0\n", "too long"},
    {"", "start 5 5 0\n", "outside the walls"},
    {"", "a b c d e f g h i j\n", "too many values"},
};

static void test_malformed_scenes_are_refused(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof BAD / sizeof BAD[0]; i++) {
        char text[1000];
        snprintf(text, sizeof text, "%s%s%s", BAD[i].before, GOOD, BAD[i].after);
        assert_int_equal(parse(text), -1);
        if (!strstr(error, BAD[i].says))
            fail_msg("'%s' does not say '%s'", error, BAD[i].says);
        assert_null(strchr(error, '\n'));
    }
}

/* Every item of the good scene is needed but the obstacle and the whiskers. */
static void test_missing_items_are_named(void **state)
{
    (void)state;
    const char *const needed[] = {"size_m", "tile_m", "floor", "body_radius_m", "start", "texture V"};
    for (size_t i = 0; i < sizeof needed / sizeof needed[0]; i++) {
        char text[1000] = GOOD;
        for (char *line; (line = strstr(text, needed[i])) && (line == text || line[-1] == '\n');)
            memmove(line, strchr(line, '\n') + 1, strlen(strchr(line, '\n')));
        assert_int_equal(parse(text), -1);
        assert_true(strlen(error) > strlen("test.scene: "));
    }
}

static void test_limits(void **state)
{
    (void)state;
    char text[20000] = GOOD;
    for (int i = 0; i < SIM_OBSTACLES_MAX - 1; i++)
        strcat(text, "obstacle 0 0 1 1\n");
    assert_int_equal(parse(text), 0);
    strcat(text, "obstacle 0 0 1 1\n");
    assert_int_equal(parse(text), -1);
    assert_non_null(strstr(error, "at most 64 fit"));
    memset(text, 'x', 600);
    strcpy(text + 600, "\n");
    assert_int_equal(parse(text), -1);
    assert_non_null(strstr(error, "line of 600 characters"));
}

/* The buffer for the refusal may be of any size. */
static void test_short_error_buffer(void **state)
{
    (void)state;
    for (size_t size = 1; size < 60; size++) {
        char small[60];
        memset(small, 'x', sizeof small);
        assert_int_equal(sim_scene_parse("wall\n", "test.scene", &scene, small, size), -1);
        assert_true(strlen(small) < size);
    }
}

static void test_file(void **state)
{
    (void)state;
    char path[] = "/tmp/sim_scene_XXXXXX";
    int file = mkstemp(path);
    assert_true(file >= 0);
    assert_int_equal(write(file, GOOD, strlen(GOOD)), (ssize_t)strlen(GOOD));
    close(file);
    assert_int_equal(sim_scene_read(path, &scene, error, sizeof error), 0);
    assert_int_equal(scene.whiskers, 2);
    unlink(path);
    assert_int_equal(sim_scene_read(path, &scene, error, sizeof error), -1);
    assert_non_null(strstr(error, "cannot be read: No such file"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_good_scene),
        cmocka_unit_test(test_poses_are_reported_on_the_map),
        cmocka_unit_test(test_mechanics_sensor_and_batch),
        cmocka_unit_test(test_faces_may_have_textures),
        cmocka_unit_test(test_blanks_do_not_matter),
        cmocka_unit_test(test_malformed_scenes_are_refused),
        cmocka_unit_test(test_missing_items_are_named),
        cmocka_unit_test(test_limits),
        cmocka_unit_test(test_short_error_buffer),
        cmocka_unit_test(test_file),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
