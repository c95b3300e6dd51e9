/* The lattice of tiles, sought in the trail of one texture tip that wanders over a floor whose tiles are known here. */
#include "near.h"

#include "floor.h"
#include "lattice.h"
#include "rooms.h"

enum { CLASSES = 3, STEPS = 3500, SEEDS = 4 };

/* As good as drawn, for a place of a floor. */
static uint32_t drawn_at(int column, int row, unsigned seed)
{
    uint32_t hash = ((uint32_t)column * 2654435761u) ^ ((uint32_t)row * 2246822519u) ^ (seed * 3266489917u);
    hash = (hash ^ hash >> 15) * 2654435761u;
    hash = (hash ^ hash >> 13) * 3266489917u;
    return hash ^ hash >> 16;
}

/* From 0 to 1. */
static double share_of(uint32_t drawn)
{
    return drawn / 4294967296.0;
}

/* Class of the patch whose middle is nearest; the middles lie anywhere, one in each square of 0.4 m. */
static int patch_class(double x, double y, unsigned seed)
{
    double nearest = INFINITY;
    int class = 0, column = (int)floor(x / 0.4), row = (int)floor(y / 0.4);
    for (int i = column - 2; i <= column + 2; i++) {
        for (int k = row - 2; k <= row + 2; k++) {
            double mx = (i + share_of(drawn_at(i, k, seed + 100))) * 0.4;
            double my = (k + share_of(drawn_at(i, k, seed + 200))) * 0.4;
            if (hypot(x - mx, y - my) < nearest) {
                nearest = hypot(x - mx, y - my);
                class = (int)(drawn_at(i, k, seed) % CLASSES);
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
    int column = (int)floor(along(g, x, y) / g->pitch), row = (int)floor(across(g, x, y) / g->pitch);
    return (int)(drawn_at(column, row, g->seed) % CLASSES);
}

/* 70 m within a square of 3 m, a window each 2 cm, one in ten of them of a class that is drawn. */
static bool find(const struct ground *g, struct nav_lattice *out)
{
    struct nav_problem p = room();
    struct nav_trail trail;
    struct nav_lattice_search search;
    struct nav_pose pose = {0.0, 0.0, 0.0};
    double turn = 0.0;
    p.arena.classes = CLASSES;
    assert_int_equal(nav_trail_init(&trail, &p.arena, &p.robot), 0);
    assert_int_equal(nav_lattice_search_init(&search, CLASSES), 0);
    for (int n = 0; n < STEPS; n++) {
        bool outside = fabs(pose.x) > 1.5 || fabs(pose.y) > 1.5;
        turn = outside ? remainder(atan2(-pose.y, -pose.x) - pose.theta, 2.0 * NAV_PI) / 4.0
                       : 0.9 * turn + 0.12 * (share_of(drawn_at(n, 1, g->seed)) - 0.5);
        nav_trail_move(&trail, (struct nav_pose){0.02, 0.0, turn});
        pose.x += 0.02 * cos(pose.theta);
        pose.y += 0.02 * sin(pose.theta);
        pose.theta += turn;
        double x = pose.x + ROOM_TIP[0].x * cos(pose.theta), y = pose.y + ROOM_TIP[0].x * sin(pose.theta);
        bool wrong = drawn_at(n, 2, g->seed) % 10 == 0;
        int class = wrong ? (int)(drawn_at(n, 3, g->seed) % CLASSES) : ground_class(g, x, y);
        float ratio[CLASSES] = {0.15f, 0.15f, 0.15f};
        ratio[class] = 2.7f;
        nav_trail_add(&trail, &pose, 0, 0.02, ratio);
        nav_trail_row_done(&trail);
    }
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

/* A tip above the middle of a tile, from the robot's centre, in a lattice that is turned against the world. */
static void test_a_tip_is_in_the_tile_below_it(void **state)
{
    (void)state;
    const struct nav_lattice l = {.turn = 0.3, .pitch = 0.4, .u = 0.1, .v = -0.05, .x = 0.2, .y = 0.3};
    double mean[NAV_JOINT_FACES], cov[NAV_JOINT_FACES * NAV_JOINT_FACES];
    struct nav_joint joint = {.room = NAV_JOINT_FACES, .mean = mean, .cov = cov};
    struct nav_floor floor;
    assert_int_equal(nav_floor_init(&floor, CLASSES), 0);
    nav_joint_begin(&joint, 0.01, 0.01);
    nav_joint_set(&joint, NAV_JOINT_X, 1.0, 0.0);
    nav_joint_set(&joint, NAV_JOINT_Y, -0.4, 0.0);
    nav_joint_set(&joint, NAV_JOINT_HEADING, 0.7, 0.0);
    nav_floor_adopt(&floor, &joint, &l, false);
    for (int n = 0; n < 25; n++) {
        int column, row;
        double along = l.u + (n % 5 - 1.5) * l.pitch, across = l.v + (n / 5 - 1.5) * l.pitch; /* tiles -2 to 2 */
        double x = l.x + along * cos(l.turn) - across * sin(l.turn) - 1.0;
        double y = l.y + along * sin(l.turn) + across * cos(l.turn) + 0.4;
        nav_floor_at(&floor, &joint, cos(0.7) * x + sin(0.7) * y, cos(0.7) * y - sin(0.7) * x, &column, &row);
        assert_int_equal(column, n % 5 - 2);
        assert_int_equal(row, n / 5 - 2);
    }
    nav_floor_free(&floor);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_a_tip_is_in_the_tile_below_it),
        cmocka_unit_test(test_pitch_turn_and_phase_of_the_tiles_are_found),
        cmocka_unit_test(test_patches_of_any_shape_are_no_lattice),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
