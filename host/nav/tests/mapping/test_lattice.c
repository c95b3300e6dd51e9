/* The lattice of tiles, sought in the trail of one texture tip that wanders over a floor whose tiles are known here. */
#include "near.h"

#include <stdlib.h>

#include "lattice.h"
#include "rooms.h"

enum { CLASSES = 3, STEPS = 3500, SEEDS = 4 };

/* Of the tile at a column and a row; as good as drawn. */
static int tile_class(long column, long row, unsigned seed)
{
    unsigned hash = ((unsigned)column * 2654435761u) ^ ((unsigned)row * 2246822519u) ^ (seed * 3266489917u);
    hash = (hash ^ hash >> 15) * 2654435761u;
    return (int)((hash ^ hash >> 13) % CLASSES);
}

/* Of the patch whose middle is nearest; the middles lie anywhere, one in a square of 0.4 m. */
static int patch_class(double x, double y, unsigned seed)
{
    double nearest = INFINITY;
    int class = 0;
    int column = (int)floor(x / 0.4), row = (int)floor(y / 0.4);
    for (int i = column - 2; i <= column + 2; i++) {
        for (int k = row - 2; k <= row + 2; k++) {
            srand((unsigned)(i * 7919 + k * 104729) ^ seed);
            double mx = (i + rand() / (double)RAND_MAX) * 0.4, my = (k + rand() / (double)RAND_MAX) * 0.4;
            if (hypot(x - mx, y - my) < nearest) {
                nearest = hypot(x - mx, y - my);
                class = rand() % CLASSES;
            }
        }
    }
    return class;
}

/* What the floor is made of: tiles of this pitch, phase and turn, or patches (pitch 0). */
struct ground {
    double pitch, u, v, turn;
    unsigned seed;
};

static double along(const struct ground *g, double x, double y)
{
    return cos(g->turn) * x + sin(g->turn) * y - g->u;
}

static double across(const struct ground *g, double x, double y)
{
    return cos(g->turn) * y - sin(g->turn) * x - g->v;
}

static int ground_class(const struct ground *g, double x, double y)
{
    if (g->pitch == 0.0)
        return patch_class(x, y, g->seed);
    return tile_class((long)floor(along(g, x, y) / g->pitch), (long)floor(across(g, x, y) / g->pitch), g->seed);
}

/* 70 m within a square of 3 m, a window each 2 cm, one in ten of them wrong. */
static bool find(const struct ground *g, struct nav_lattice *out)
{
    struct nav_problem p = room();
    struct nav_trail trail;
    struct nav_lattice_search search;
    struct nav_pose pose = {0.0, 0.0, 0.0}, still = {0.0, 0.0, 0.0};
    double turns = 0.0;
    uint32_t drawn = g->seed + 1;
    p.arena.classes = CLASSES;
    assert_int_equal(nav_trail_init(&trail, &p.arena, &p.robot), 0);
    assert_int_equal(nav_lattice_search_init(&search, CLASSES), 0);
    for (int n = 0; n < STEPS; n++) {
        drawn = drawn * 1664525u + 1013904223u;
        bool outside = fabs(pose.x) > 1.5 || fabs(pose.y) > 1.5;
        turns = outside ? remainder(atan2(-pose.y, -pose.x) - pose.theta, 2.0 * NAV_PI) / 4.0
                        : 0.9 * turns + 0.06 * ((drawn >> 8) / (double)(1 << 23) - 1.0);
        nav_trail_move(&trail, (struct nav_pose){0.02, 0.0, turns});
        pose.x += 0.02 * cos(pose.theta);
        pose.y += 0.02 * sin(pose.theta);
        pose.theta += turns;
        double x = pose.x + ROOM_TIP[0].x * cos(pose.theta), y = pose.y + ROOM_TIP[0].x * sin(pose.theta);
        int class = drawn % 1000003 % 10 == 0 ? (int)(drawn >> 16) % CLASSES : ground_class(g, x, y);
        float ratio[CLASSES] = {0.15f, 0.15f, 0.15f};
        ratio[class] = 2.7f;
        nav_trail_add(&trail, &pose, 0, 0.02, ratio);
        nav_trail_row_done(&trail);
    }
    nav_trail_move(&trail, still);
    bool found = nav_lattice_find(&search, &trail, 0.0, out);
    nav_trail_free(&trail);
    nav_lattice_search_free(&search);
    return found;
}

static void test_pitch_turn_and_phase_of_the_tiles_are_found(void **state)
{
    (void)state;
    for (unsigned seed = 0; seed < SEEDS; seed++) {
        const struct ground g = {
            .pitch = 0.3 + 0.08 * seed, .u = 0.03 * seed, .v = 0.1, .turn = 0.38 * seed, .seed = seed};
        struct nav_lattice l;
        assert_true(find(&g, &l));
        double turn = remainder(l.turn - g.turn, NAV_PI / 2.0);
        assert_near(l.pitch, g.pitch, 0.02 * g.pitch);
        assert_near(turn, 0.0, 0.035);
        /* A crossing of the lines that were found, near their middle, is one of the tiles' corners. */
        double x = l.x + l.u * cos(l.turn) - l.v * sin(l.turn), y = l.y + l.u * sin(l.turn) + l.v * cos(l.turn);
        assert_near(remainder(along(&g, x, y), g.pitch), 0.0, 0.03);
        assert_near(remainder(across(&g, x, y), g.pitch), 0.0, 0.03);
    }
}

static void test_patches_of_any_shape_are_no_lattice(void **state)
{
    (void)state;
    for (unsigned seed = 0; seed < SEEDS; seed++) {
        const struct ground g = {.pitch = 0.0, .seed = seed};
        struct nav_lattice l;
        assert_false(find(&g, &l));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_pitch_turn_and_phase_of_the_tiles_are_found),
        cmocka_unit_test(test_patches_of_any_shape_are_no_lattice),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
