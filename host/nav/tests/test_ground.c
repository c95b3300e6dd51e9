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

/* Adds what a model makes of a reading, which stands for so much, to the sums of all codes. */
static void add(struct nav_likelihood *l, int w, const double *reading, double share, double *sum)
{
    l->model[w].kind->fill(&l->model[w], reading, l->ratio[w]);
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
    static double sum[8][NAV_CODES_MOST];
    for (int w = 0; w < l->whiskers; w++) {
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
        assert_true(l->model[1].met > 0.02 && l->model[1].met < 0.9);
        judge_map(l, &rng);
        nav_likelihood_free(l);
    }
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
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
