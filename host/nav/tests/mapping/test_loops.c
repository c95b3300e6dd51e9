/* Loops that close: how sure an association is, the vote of hypotheses, corners felt twice, tiles read again. */
#include "loops.h"

#include "arena.h"
#include "mapper.h"
#include "near.h"
#include "segment.h"

enum { CLASSES = 3, TILES = 6, LOOPS_MOST = 64, ROWS_MOST = 1000 };

static struct nav_sighting sighting(long row, double way)
{
    return (struct nav_sighting){.row = row, .way = way, .x = 0.1, .y = 0.2};
}

static void test_evidence_is_counted_in_odds(void **state)
{
    (void)state;
    assert_near(nav_closure_doubt(0.5, 0.0), 0.5, 1e-12);
    assert_near(nav_closure_doubt(0.5, log(9.0)), 0.1, 1e-12);
    assert_near(nav_closure_doubt(0.1, -log(9.0)), 0.5, 1e-12);
    assert_near(nav_closure_doubt(0.0, 1.0), 0.0, 0.0);
    assert_near(nav_closure_doubt(1.0, 1.0), 1.0, 0.0);
}

/* Contacts in a row with one face say little more than the first of them. */
static void test_contacts_of_one_stretch_are_not_counted_as_fresh(void **state)
{
    (void)state;
    struct nav_stretch s;
    nav_stretch_begin(&s, sighting(0, 0.0), 4.0);
    nav_stretch_feel(&s, sighting(9, 0.9), 0.05, 0.9, 1.0);
    assert_false(s.open); /* not away */
    nav_stretch_feel(&s, sighting(30, 3.0), 0.05, 0.9, 1.0);
    assert_true(s.open);
    assert_int_equal(s.then.row, 9);
    assert_near(s.doubt, 0.1, 1e-12);
    assert_false(nav_stretch_confirmed(&s));
    for (long row = 31; row < 90; row++)
        nav_stretch_feel(&s, sighting(row, 0.1 * (double)row), 0.001, 0.99, 1.0);
    assert_true(nav_stretch_confirmed(&s));
    assert_near(s.doubt, nav_closure_doubt(0.1, log(4.0)), 1e-9);
    nav_stretch_feel(&s, sighting(200, 20.0), 0.005, 0.99, 1.0);
    assert_false(s.open); /* its place was known all the time */
}

/* Six contacts with a wall 0.3 m ahead. */
static void feel_wall(struct nav_particle_map *map)
{
    for (int n = 0; n < 6; n++) {
        struct nav_touch touch = {.x = 0.3, .y = 0.03 * n, .along_x = 1.0, .variance = 25e-6, .normal = NAN};
        struct nav_contact contact = {nav_touches_keep(&map->touches, touch), 0.005, 0.2, 0.01};
        (void)nav_faces_take(&map->faces, &map->joint, &map->touches, &contact);
        (void)nav_segment_take(&map->faces, &map->joint, &map->touches, &contact, -1.0);
    }
}

/* Other faces are as dense as contacts with them are: 0.55 a metre, of all directions, against 8 of one that is known
 * to 5 cm. */
static void test_a_row_of_contacts_may_be_of_another_face(void **state)
{
    (void)state;
    struct nav_particle_map map;
    assert_int_equal(nav_particle_map_init(&map, 1), 0);
    feel_wall(&map);
    assert_int_equal(map.faces.count, 1);
    map.touches.held = map.faces.loose = 0;
    map.faces.row = 100;
    map.faces.way = 5.0;
    nav_joint_set(&map.joint, NAV_JOINT_X, 0.0, 0.05 * 0.05);
    feel_wall(&map);
    assert_int_equal(map.faces.count, 1);
    const struct nav_stretch *s = &map.faces.face[0].stretch;
    assert_true(s->open && nav_stretch_confirmed(s));
    assert_true(s->doubt > 0.55 / 4.0 / 8.0 / 2.0 && s->doubt < 0.55 / 8.0);
    nav_particle_map_free(&map);
}

/* Its only face was felt at one row, and after a way without it up to another. */
static void felt_again(struct nav_particle_map *map, long then, long now, double probability)
{
    struct nav_face *g = &map->faces.face[0];
    map->faces.count = 1;
    nav_stretch_begin(&g->stretch, sighting(then, 0.0), 4.0);
    for (long row = now - 4; row <= now; row++)
        nav_stretch_feel(&g->stretch, sighting(row, 5.0), 0.03, probability, 1.0);
}

static void test_hypotheses_vote(void **state)
{
    (void)state;
    static struct nav_particle_map map[2];
    struct nav_sequence sequence = {.weighed = -1};
    struct nav_closure out[NAV_LOOPS_MOST];
    struct nav_loops loops = {map, 2, &map[0], 50};
    felt_again(&map[0], 7, 50, 0.99);
    felt_again(&map[1], 8, 50, 0.99); /* of a face that it touched last in another row */
    assert_int_equal(nav_loops_close(&loops, &sequence, out), 0);
    felt_again(&map[1], 7, 45, 0.6);
    assert_int_equal(nav_loops_close(&loops, &sequence, out), 1);
    assert_int_equal(out[0].kind, NAV_CLOSURE_FACE);
    assert_int_equal(out[0].then.row, 7);
    assert_int_equal(out[0].now.row, 50);
    assert_near(out[0].doubt, nav_closure_doubt(0.01, log(4.0)), 1e-12);
    assert_int_equal(nav_loops_close(&loops, &sequence, out), 0); /* not twice */
    loops.best = &map[1];
    map[1].faces.face[0].stretch.last.row = 50;
    assert_int_equal(nav_loops_close(&loops, &sequence, out), 0);
    felt_again(&map[0], 7, 50, 0.8); /* not sure enough */
    loops.best = &map[0];
    assert_int_equal(nav_loops_close(&loops, &sequence, out), 0);
}

/* A robot on a floor of tiles of 0.5 m whose places and textures are given by hand. */
struct floor_walk {
    struct nav_problem problem;
    struct nav_record record;
    struct nav_particle_map map;
    struct nav_sequence sequence;
};

static const struct nav_tip TIP[] = {{0.0, 0.0}};

static void walk_begin(struct floor_walk *w)
{
    struct nav_lattice lattice = {.pitch = 0.5, .sigma_m = 1e-3, .sigma_pitch = 1e-4, .sigma_turn = 1e-4};
    *w = (struct floor_walk){.problem = {.robot = {.tips = 1, .tip = TIP}}};
    w->record = (struct nav_record){.problem = &w->problem, .tips = 1, .classes = CLASSES};
    assert_int_equal(nav_particle_map_init(&w->map, CLASSES), 0);
    assert_int_equal(nav_sequence_init(&w->sequence, CLASSES), 0);
    nav_sequence_clear(&w->sequence);
    nav_floor_adopt(&w->map.floor, &w->map.joint, &lattice, false);
}

static void walk_free(struct floor_walk *w)
{
    nav_particle_map_free(&w->map);
    nav_sequence_free(&w->sequence);
}

static void walk_read(struct floor_walk *w, double x, double y, double sd, int texture)
{
    float window[1 + CLASSES] = {0.02F, 0.3F, 0.3F, 0.3F};
    struct nav_record_row row = {.window = window};
    window[1 + texture] = 2.4F;
    w->map.faces.row++;
    w->map.faces.way += 0.02;
    nav_joint_set(&w->map.joint, NAV_JOINT_X, x, sd * sd);
    nav_joint_set(&w->map.joint, NAV_JOINT_Y, y, sd * sd);
    nav_sequence_take(&w->sequence, &w->map, &w->record, &row);
}

/* Drives along TILES tiles of these textures, and out of them. */
static void walk_along(struct floor_walk *w, double y, double sd, const int *texture)
{
    for (int n = 0; n < TILES * 25; n++)
        walk_read(w, 0.01 + 0.02 * n, y, sd, texture[n / 25]);
}

/* How sure the sequence is of another place, after a way and a drive over these textures. */
static double walk_again(struct floor_walk *w, double y, double sd, const int *texture)
{
    w->map.faces.way += 5.0;
    w->sequence.closure.doubt = 1.0;
    walk_along(w, y, sd, texture);
    w->map.faces.way += 1.0;
    walk_read(w, -4.25, -4.25, sd, 0);
    return w->sequence.closure.doubt;
}

static const int FIRST[TILES] = {0, 1, 2, 0, 2, 1}, SECOND[TILES] = {1, 2, 0, 1, 1, 2};

static void test_tiles_read_again_close_a_loop(void **state)
{
    (void)state;
    struct floor_walk w;
    struct nav_closure out[NAV_LOOPS_MOST];
    walk_begin(&w);
    walk_along(&w, 0.25, 0.001, FIRST);
    long until = w.map.faces.row;
    assert_true(walk_again(&w, 0.25, 0.05, FIRST) < 0.001);
    assert_true(w.sequence.closure.then.row <= until && w.sequence.closure.now.row > until);
    assert_near(w.sequence.closure.now.x, 2.75 + 4.25, 1e-3); /* the middle of the last tile, from where it is then */
    assert_near(w.sequence.closure.now.y, 0.25 + 4.25, 1e-3);
    struct nav_loops loops = {&w.map, 1, &w.map, w.map.faces.row};
    assert_int_equal(nav_loops_close(&loops, &w.sequence, out), 1);
    assert_int_equal(out[0].kind, NAV_CLOSURE_TEXTURE);
    assert_true(walk_again(&w, 0.25, 0.001, FIRST) > 0.99); /* the place was known: no sequence is begun */
    walk_free(&w);
}

static void test_other_tiles_do_not(void **state)
{
    (void)state;
    struct floor_walk w;
    walk_begin(&w);
    walk_along(&w, 0.25, 0.001, FIRST);
    assert_true(walk_again(&w, 0.25, 0.05, SECOND) > 0.9);
    walk_free(&w);
}

/* Two rows of tiles look alike: which one it is follows from the pose alone. */
static void test_a_place_that_looks_alike_does_not(void **state)
{
    (void)state;
    struct floor_walk w;
    walk_begin(&w);
    walk_along(&w, 0.25, 0.001, FIRST);
    walk_along(&w, 0.75, 0.001, FIRST);
    assert_true(walk_again(&w, 0.25, 0.1, FIRST) < NAV_CLOSURE_FALSE);
    assert_true(walk_again(&w, 0.25, 0.19, FIRST) > NAV_CLOSURE_FALSE);
    walk_free(&w);
}

static void test_a_tile_counts_once(void **state)
{
    (void)state;
    struct floor_walk w;
    double doubt[2];
    for (int times = 0; times < 2; times++) {
        walk_begin(&w);
        walk_along(&w, 0.25, 0.001, FIRST);
        w.map.faces.way += 5.0;
        for (int n = 0; n < (times ? 400 : 20); n++)
            walk_read(&w, 0.25, 0.25, 0.05, FIRST[0]);
        w.map.faces.way += 1.0;
        walk_read(&w, -4.25, -4.25, 0.05, 0);
        doubt[times] = w.sequence.closure.doubt;
        walk_free(&w);
    }
    assert_near(doubt[0], doubt[1], 1e-6);
    assert_true(doubt[0] > NAV_CLOSURE_FALSE);
}

/* A room of 2 m, whiskers to both sides, and wheels that report 2 % too much. */
static const uint8_t ROOM_FLOOR[] = {0};
static const struct nav_ray ROOM_RAY[] = {{0.06, 0.06, 0.7, 0.14}, {0.06, -0.06, -0.7, 0.14}};

struct room_run {
    struct nav_mapper *mapper;
    const struct nav_problem *problem;
    struct nav_pose at[ROWS_MOST]; /* true, after each row */
    long row;
};

static void room_step(struct room_run *run, struct nav_pose before, struct nav_pose step)
{
    double radial[2];
    struct nav_estimate estimate;
    struct nav_pose *at = &run->at[run->row];
    *at = nav_compose(before, step);
    for (int r = 0; r < 2; r++) {
        const struct nav_ray *ray = &ROOM_RAY[r];
        double c = cos(at->theta), s = sin(at->theta);
        radial[r] = nav_arena_range(&run->problem->arena, at->x + c * ray->x - s * ray->y,
                                    at->y + s * ray->x + c * ray->y, at->theta + ray->yaw, ray->length);
    }
    struct nav_row taken = {
        .t_s = 0.1 * (double)++run->row, .odometry = {1.02 * step.x, 0.0, step.theta}, .radial_m = radial};
    nav_mapper_step(run->mapper, &taken, &estimate);
}

/* Once round a square of 0.74 m, counterclockwise, two of whose sides are along walls. */
static void room_round(struct room_run *run)
{
    for (int n = 0; n < 4 * (37 + 10); n++) {
        struct nav_pose before = run->row ? run->at[run->row - 1] : (struct nav_pose){1.87, 1.13, NAV_PI / 2.0};
        bool turns = n % 47 >= 37;
        room_step(run, before, (struct nav_pose){turns ? 0.0 : 0.02, 0.0, turns ? NAV_PI / 20.0 : 0.0});
    }
}

static void test_a_corner_felt_again_closes_a_loop(void **state)
{
    (void)state;
    struct nav_problem p = {.arena = {.size_x = 2.0, .size_y = 2.0, .tile = 2.0, .columns = 1, .rows = 1},
                            .robot = {.body_radius = 0.1, .odometry_relative = 0.05, .radial_sigma = 0.005},
                            .seed = 3};
    struct nav_mapper_options options = nav_mapper_default();
    struct nav_mapper_loop loop[LOOPS_MOST];
    static struct room_run r;
    long corners = 0;
    p.arena.floor = ROOM_FLOOR;
    p.arena.classes = 1;
    p.robot.rays = 2;
    p.robot.ray = ROOM_RAY;
    nav_settings_default(&p.settings);
    struct nav_mapper *m = nav_mapper_new(&p, &options);
    assert_non_null(m);
    r.mapper = m;
    r.problem = &p;
    for (int times = 0; times < 4; times++)
        room_round(&r);
    long count = nav_mapper_loops(m, loop, LOOPS_MOST);
    assert_true(count > 0 && count < LOOPS_MOST);
    for (long n = 0; n < count; n++) {
        assert_true(loop[n].probability > 1.0 - NAV_CLOSURE_FALSE);
        assert_true(loop[n].to > loop[n].from);
        if (loop[n].kind != NAV_MAPPER_LOOP_CORNER)
            continue;
        corners++;
        assert_true(loop[n].to - loop[n].from > 100); /* a round is 188 rows */
        struct nav_pose now = nav_compose(r.at[loop[n].to], (struct nav_pose){loop[n].x, loop[n].y, 0.0});
        struct nav_pose then = nav_compose(r.at[loop[n].from], (struct nav_pose){loop[n].from_x, loop[n].from_y, 0.0});
        assert_near(hypot(now.x - 2.0, now.y - 2.0), 0.0, 0.03);
        assert_near(hypot(then.x - 2.0, then.y - 2.0), 0.0, 0.03);
    }
    assert_true(corners >= 1);
    nav_mapper_free(m);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_evidence_is_counted_in_odds),
        cmocka_unit_test(test_contacts_of_one_stretch_are_not_counted_as_fresh),
        cmocka_unit_test(test_a_row_of_contacts_may_be_of_another_face),
        cmocka_unit_test(test_hypotheses_vote),
        cmocka_unit_test(test_tiles_read_again_close_a_loop),
        cmocka_unit_test(test_other_tiles_do_not),
        cmocka_unit_test(test_a_place_that_looks_alike_does_not),
        cmocka_unit_test(test_a_tile_counts_once),
        cmocka_unit_test(test_a_corner_felt_again_closes_a_loop),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
