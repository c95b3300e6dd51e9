/* Ground that was never mapped: which of it can be reached, what is believed of it, and that every likelihood is a
 * distribution over what its sensor can report, at random places of random maps. */
#include "ground.h"

#include <string.h>

#include "likelihood.h"
#include "near.h"
#include "rng.h"
#include "rooms.h"

/* A room of 1 m, walls of 5 cm with a gap at the right, and 1 m of ground around it that nobody mapped. */
static struct nav_arena padded(struct nav_box box[9], double gap)
{
    const struct nav_box all[9] = {{0.95, 0.95, 2.05, 1.0}, {0.95, 2.0, 2.05, 2.05},     {0.95, 1.0, 1.0, 2.0},
                                   {2.0, 1.0, 2.05, 1.5},   {2.0, 1.5 + gap, 2.05, 2.0}, {0.0, 0.0, 0.95, 3.0},
                                   {2.0, 0.0, 3.0, 3.0},    {0.95, 0.0, 2.0, 0.95},      {0.95, 2.05, 2.0, 3.0}};
    memcpy(box, all, sizeof all);
    return (struct nav_arena){.size_x = 3.0, .size_y = 3.0, .tile = 0.5, .boxes = 9, .box = box, .unknown = 4};
}

static double prior_beyond_gap(double gap, double *weight)
{
    struct nav_box box[9];
    const struct nav_arena arena = padded(box, gap);
    struct nav_obstacles o;
    struct nav_ground g;
    assert_int_equal(nav_obstacles_init(&o, &arena, 0.3), 0);
    assert_int_equal(nav_ground_init(&g, &o, 0.1), 0);
    assert_near(nav_ground_prior(&g, &o, 1.5, 1.5), 1.0, 0.0);
    double beyond = nav_ground_prior(&g, &o, 2.6, 1.7), behind = nav_ground_prior(&g, &o, 0.4, 1.5);
    assert_near(beyond, behind, 0.0); /* all the way round */
    *weight = g.weight;
    nav_ground_free(&g);
    nav_obstacles_free(&o);
    return beyond;
}

static void ground_that_nobody_comes_to_holds_nothing(void **state)
{
    (void)state;
    double weight, beyond;
    assert_near(prior_beyond_gap(0.0, &weight), 0.0, 0.0);
    assert_near(prior_beyond_gap(0.15, &weight), 0.0, 0.0); /* narrower than the robot */
    beyond = prior_beyond_gap(0.35, &weight);
    assert_near(beyond, weight, 0.0);
    /* A hundredth of the belief: of 0.64 m^2 in the room, 6.5 m^2 without. */
    assert_near(weight, 0.01 / 0.99 * 0.64 / 6.5, 2e-4);
}

static void a_small_patch_weighs_as_much_as_mapped_ground(void **state)
{
    (void)state;
    const struct nav_box patch = {0.5, 0.5, 0.52, 0.52};
    const struct nav_arena arena = {.size_x = 2.0, .size_y = 2.0, .boxes = 1, .box = &patch, .unknown = 1};
    struct nav_obstacles o;
    struct nav_ground g;
    assert_int_equal(nav_obstacles_init(&o, &arena, 0.3), 0);
    assert_int_equal(nav_ground_init(&g, &o, 0.1), 0);
    assert_near(nav_ground_prior(&g, &o, 0.51, 0.51), 1.0, 0.0);
    nav_ground_free(&g);
    nav_obstacles_free(&o);
}

enum { MAPS = 20, PLACES = 50, LEVELS = 4 };
static const double CONFUSED[LEVELS][LEVELS] = {
    {0.7, 0.1, 0.1, 0.1}, {0.2, 0.5, 0.2, 0.1}, {0.1, 0.2, 0.6, 0.1}, {0.0, 0.1, 0.3, 0.6}};

static int own_expect(const void *self, double x, double y, double theta)
{
    (void)self;
    (void)theta;
    return (int)floor(3.0 * (x + y)) % (LEVELS + 1); /* one in five is not known */
}

static void own_fill(const void *self, const double *reading, double *likelihood)
{
    (void)self;
    for (int k = 0; k < LEVELS; k++)
        likelihood[k] = CONFUSED[k][(int)reading[0]];
}

enum { SENSORS = 8, STATES = 8 };

/* Reads one sensor alone, after so much path. What it says of ground that is not mapped follows from what it said
 * before. */
static void read_one(struct nav_likelihood *l, int w, const double *reading, double moved)
{
    const double *all[SENSORS] = {NULL};
    double weight[SENSORS] = {0.0}, path[SENSORS] = {0.0};
    all[w] = reading;
    weight[w] = 1.0;
    path[w] = moved;
    nav_likelihood_read(l, &(struct nav_evidence){.reading = all, .weight = weight, .moved = path});
}

static const double MOVED = 0.05;

/* Adds what a model makes of a reading, which stands for so much, to the sums of all codes; nothing is kept of it. */
static void add(struct nav_likelihood *l, int w, const double *reading, double share, double *sum)
{
    double before[STATES];
    size_t bytes = (size_t)l->unmapped[w].states * sizeof *before;
    memcpy(before, l->unmapped[w].now, bytes);
    read_one(l, w, reading, MOVED);
    memcpy(l->unmapped[w].now, before, bytes);
    for (int k = 0; k < l->model[w].codes; k++)
        sum[k] += share * l->ratio[w][k];
}

/* Below 0 a distance is reported as 0; what is even ends at the whisker's length. */
static void sum_range(struct nav_likelihood *l, int w, double *sum)
{
    const struct nav_model *m = &l->model[w];
    const double step = m->length / 1000.0, nothing = INFINITY, far = 1.5 * m->length;
    double outside = 0.0;
    for (double z = -6.0 * m->sigma + step / 2.0; z < far; z += step) {
        outside += z < 0.0 || z > m->length ? step / m->length : 0.0;
        add(l, w, &z, step / m->length, sum);
    }
    add(l, w, &far, -outside, sum);
    add(l, w, &nothing, 1.0, sum);
}

static void sum_classes(struct nav_likelihood *l, int w, double *sum)
{
    const struct nav_model *m = &l->model[w];
    for (int said = 0; said < m->codes - 1; said++) {
        double reading[LEVELS] = {said, 0.0}, share = 1.0 / (m->codes - 1);
        bool own = m->kind == &NAV_OWN_MEASUREMENT;
        for (int k = 0; k < LEVELS && own; k++)
            share = (k == 0 ? 0.0 : share) + CONFUSED[k][said] / LEVELS;
        for (int k = 0; k < m->values && !own; k++)
            reading[k] = k == said ? 0.0 : -2.0;
        add(l, w, reading, share, sum);
    }
}

/* Sums over all readings of a sensor, by code; `ratio` is to a broken sensor, which the shares are of. */
static void sum_readings(struct nav_likelihood *l, int w, double *sum)
{
    memset(sum, 0, (size_t)l->model[w].codes * sizeof *sum);
    if (l->model[w].kind == &NAV_RANGE_MEASUREMENT)
        sum_range(l, w, sum);
    else if (l->model[w].kind != &NAV_NORMAL_MEASUREMENT)
        sum_classes(l, w, sum);
    for (int n = 0; n < 3600 && l->model[w].kind == &NAV_NORMAL_MEASUREMENT; n++) {
        const double reading[2] = {NAV_PI * (n / 1800.0 - 1.0), 0.3};
        add(l, w, reading, 1.0 / 3600.0, sum);
    }
}

static struct nav_box drawn(struct nav_rng *rng)
{
    double x = 2.5 * nav_rng_uniform(rng), y = 2.5 * nav_rng_uniform(rng);
    return (struct nav_box){x, y, x + 0.1 + 0.4 * nav_rng_uniform(rng), y + 0.1 + 0.4 * nav_rng_uniform(rng)};
}

/* Every code that is met, and "not known" of every sensor. */
static void judge_map(struct nav_likelihood *l, struct nav_rng *rng)
{
    static double sum[SENSORS][NAV_CODES_MOST];
    for (int w = 0; w < l->whiskers; w++) {
        l->trust[w].working = 1.0;
        sum_readings(l, w, sum[w]);
        assert_near(sum[w][l->model[w].codes - 1], 1.0, 0.01);
    }
    for (int n = 0; n < PLACES; n++) {
        double turn = 2.0 * NAV_PI * nav_rng_uniform(rng);
        const struct nav_place at = {3.0 * nav_rng_uniform(rng), 3.0 * nav_rng_uniform(rng), cos(turn), sin(turn)};
        nav_likelihood_expect(l, &at, l->scratch);
        for (int w = 0; w < l->whiskers; w++)
            assert_near(sum[w][l->scratch[w]], 1.0, 0.01);
    }
}

static void every_likelihood_is_a_distribution(void **state)
{
    (void)state;
    static const uint8_t floor_of[] = {0, 1, 2, 0, 1, 2, 0, 1, 3};
    const struct nav_sensor own = {.values = 1, .codes = LEVELS, .expect = own_expect, .fill = own_fill};
    struct nav_rng rng;
    nav_rng_seed(&rng, 3, 0);
    for (int n = 0; n < MAPS; n++) {
        struct nav_box box[9];
        struct nav_problem p = room();
        for (int b = 0; b < 9; b++)
            box[b] = drawn(&rng);
        p.arena = (struct nav_arena){3.0, 3.0, 1.0, 3, 3, floor_of, 3, 9, box, 4};
        p.robot.normals = true;
        p.robot.sensor = &own;
        p.robot.sensors = 1;
        p.settings.texture.temper = 1.0;
        struct nav_likelihood *l = nav_likelihood_new(&p.arena, &p.robot, &p.settings, 0.002 * (n % 5));
        judge_map(l, &rng);
        const double said[LEVELS] = {-5.0, 0.0, -3.0, -4.0}, felt = 0.03;
        read_one(l, 0, said, INFINITY);
        read_one(l, 1, &felt, INFINITY);
        judge_map(l, &rng); /* likewise after a reading */
        nav_likelihood_free(l);
    }
}

/* Where nothing is mapped a whisker stays on one tile for a while, and at what it feels: what it says again is expected
 * there, what it says anew is not, and after a long way all is as it was. */
static void readings_of_one_unmapped_thing_count_once(void **state)
{
    (void)state;
    static const uint8_t floor_of[] = {0, 0, 1, 2, 0, 1, 2, 0, 3};
    const double zero[] = {0.0, -9.0, -9.0}, one[] = {-9.0, 0.0, -9.0}, felt = 0.03, nothing = INFINITY;
    struct nav_box box[9];
    struct nav_problem p = room();
    p.arena = padded(box, 0.35);
    p.arena.tile = 1.0;
    p.arena.columns = p.arena.rows = p.arena.classes = 3;
    p.arena.floor = floor_of;
    p.settings.texture.temper = 1.0;
    struct nav_likelihood *l = nav_likelihood_new(&p.arena, &p.robot, &p.settings, 0.0);
    double first, anew, far;
    /* Of 4, 2 and 2 tiles, each counted once more than it is there. */
    read_one(l, 0, zero, INFINITY);
    first = l->unknown[0];
    assert_near(exp(first), 5.0 / 11.0 * exp((double)l->table[0][0]) + 6.0 / 11.0 * exp((double)l->table[0][1]), 1e-6);
    read_one(l, 0, zero, 0.02);
    assert_true(l->unknown[0] > first + 0.6);
    assert_true((double)l->table[0][0] - l->unknown[0] < 0.1); /* a mapped tile that fits gains next to nothing */
    read_one(l, 0, one, 0.02);
    anew = l->unknown[0];
    assert_true(anew < -0.8);
    read_one(l, 0, zero, 100.0);
    far = l->unknown[0];
    assert_near(far, first, 1e-9);
    read_one(l, 1, &felt, INFINITY);
    first = l->unknown[1];
    assert_near(exp(first), 0.995 * nav_range_unmapped(&l->model[1], felt, true) * l->unmapped[1].share[1], 0.02);
    read_one(l, 1, &felt, 0.01);
    assert_true(l->unknown[1] > first + 0.3);
    read_one(l, 1, &nothing, 0.01);
    anew = l->unknown[1];
    read_one(l, 1, &nothing, 0.01);
    assert_true(l->unknown[1] > anew + 0.3);
    nav_likelihood_free(l);
}

/* What the log keeps of a row is read again as it was. */
static void what_is_given_of_unmapped_ground_is_taken(void **state)
{
    (void)state;
    struct nav_problem p = room();
    struct nav_likelihood *l = nav_likelihood_new(&p.arena, &p.robot, &p.settings, 0.0);
    const double said[] = {0.0, -9.0, -9.0}, nowhere = NAN, weight[] = {0.5, 0.0}, unknown[] = {-0.25, 0.0};
    const double *reading[] = {said, &nowhere};
    double before = l->unmapped[0].now[0];
    nav_likelihood_read(l, &(struct nav_evidence){.reading = reading, .weight = weight, .unknown = unknown});
    int last = l->model[0].codes - 1;
    assert_near((double)l->table[0][last], -0.25, 1e-7);
    assert_near(0.5 * log(l->trust[0].working * l->ratio[0][last] + 1.0 - l->trust[0].working), -0.25, 1e-9);
    assert_near(l->unmapped[0].now[0], before, 0.0);
    nav_likelihood_free(l);
}

/* A sensor that was not read says the same of every place. */
static void what_was_not_read_prefers_no_place(void **state)
{
    (void)state;
    struct nav_problem p = room();
    struct nav_likelihood *l = nav_likelihood_new(&p.arena, &p.robot, &p.settings, 0.0);
    const double nothing[] = {NAN, NAN}, nowhere = NAN, weight[] = {0.0, 0.0}, *reading[] = {nothing, &nowhere};
    nav_likelihood_read(l, &(struct nav_evidence){.reading = reading, .weight = weight});
    for (int w = 0; w < l->whiskers; w++) {
        for (int k = 0; k < l->model[w].codes; k++)
            assert_near((double)l->table[w][k], 0.0, 0.0);
    }
    nav_likelihood_free(l);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(ground_that_nobody_comes_to_holds_nothing),
        cmocka_unit_test(a_small_patch_weighs_as_much_as_mapped_ground),
        cmocka_unit_test(every_likelihood_is_a_distribution),
        cmocka_unit_test(what_was_not_read_prefers_no_place),
        cmocka_unit_test(readings_of_one_unmapped_thing_count_once),
        cmocka_unit_test(what_is_given_of_unmapped_ground_is_taken),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
