/* What cells expect, against counting the lattice's sub-poses one by one. The arena is so large that a layer's cells do
 * not fit one band: they are numbered in two, each with its own list of mixes, and one row is left for the second. */
#include "mixture.h"

#include <stdlib.h>

#include "near.h"
#include "rooms.h"

enum { NX = 300, NY = 216, HEADINGS = 4, SUB = 2, TURNS = 2, PARTS = SUB * SUB * TURNS };
static const double CELL = 0.04;

struct tables {
    struct nav_problem problem;
    struct nav_likelihood *likelihood;
    struct nav_expected *expected;
    struct nav_mixture *mixture;
};

/* Stripes of texture along x and y, and a box in a corner. */
static struct tables large(void)
{
    static const uint8_t floor[] = {0, 1, 1, 0, 1, 0, 0, 1, 0};
    static const struct nav_box box = {11.0, 0.0, 12.0, 0.9};
    struct tables t = {.problem = room()};
    t.problem.arena.size_x = NX * CELL;
    t.problem.arena.size_y = NY * CELL;
    t.problem.arena.tile = 4.0;
    t.problem.arena.columns = t.problem.arena.rows = 3;
    t.problem.arena.floor = floor;
    t.problem.arena.box = &box;
    t.likelihood = nav_likelihood_new(&t.problem.arena, &t.problem.robot, &t.problem.settings, 0.01);
    t.expected = nav_expected_new(t.likelihood, CELL / SUB, HEADINGS, 3 * SUB);
    assert_non_null(t.expected);
    t.mixture = nav_mixture_new(t.expected, NX, NY, SUB, TURNS);
    assert_non_null(t.mixture);
    const double texture[] = {0.0, -3.0}, distance = 0.1, both[] = {1.0, 1.0};
    const double *reading[] = {texture, &distance};
    nav_likelihood_read(t.likelihood, &(struct nav_evidence){reading, both});
    nav_expected_evaluate(t.expected, t.likelihood);
    nav_mixture_begin(t.mixture, t.expected);
    return t;
}

static void free_tables(struct tables *t)
{
    nav_mixture_free(t->mixture);
    nav_expected_free(t->expected);
    nav_likelihood_free(t->likelihood);
}

/* Signatures of the sub-poses of a shifted and turned cell; returns how many of them are free. */
static int sub_poses(const struct tables *t, const struct nav_layer *layer, int i, int j, uint32_t signature[PARTS])
{
    int free_poses = 0;
    for (int n = 0; n < PARTS; n++) {
        int k = (layer->heading + n / SUB / SUB) % HEADINGS;
        int x = i * SUB + layer->x + n % SUB, y = j * SUB + layer->y + n / SUB % SUB;
        signature[n] = nav_expected_row(t->expected, k, y)[x];
        free_poses += signature[n] != 0;
    }
    return free_poses;
}

static double naive(const struct tables *t, const uint32_t signature[PARTS])
{
    double sum = 0.0, best = 0.0;
    for (uint32_t n = 0; n + 1 < t->expected->signatures; n++)
        best = fmax(best, t->expected->value[n]);
    for (int n = 0; n < PARTS; n++)
        sum += signature[n] ? t->expected->value[signature[n] - 1] / best / PARTS : 0.0;
    return sum;
}

/* One row of cells: likelihoods, parts, and that nothing free lies outside the row's span. */
static void check_row(struct tables *t, const struct nav_layer *layer, int j)
{
    static float like[NX];
    uint32_t signature[PARTS];
    nav_mixture_look_up(t->mixture, layer, j, 0, NX, like);
    for (int i = 0; i < NX; i++) {
        const struct nav_mix *mix = nav_mixture_at(t->mixture, layer, i, j);
        double share = 0.0;
        int free_poses = sub_poses(t, layer, i, j, signature);
        for (uint32_t n = mix->first; n < mix->end; n++)
            share += (double)t->mixture->part[n].share;
        assert_near(share, (double)free_poses / PARTS, 1e-6);
        assert_near((double)like[i], naive(t, signature), 1e-6);
        if (free_poses > 0)
            assert_true(i >= t->mixture->begin[j] && i < t->mixture->end[j]);
    }
}

static void every_cell_of_a_large_arena_expects_its_own_sub_poses(void **state)
{
    (void)state;
    static const int shift[] = {-1, 0, 1};
    struct tables t = large();
    assert_int_equal(t.mixture->bands, 2);
    assert_int_equal(NY + 2 - t.mixture->band, 1);
    for (int n = 0; n < HEADINGS * 9; n++) {
        const struct nav_layer layer = {n / 9, shift[n % 3], shift[n / 3 % 3]};
        nav_mixture_work_out(t.mixture, &layer);
        for (int j = 0; j < NY; j++) {
            bool edge = j < 3 || j >= NY - 3 || abs(j - t.mixture->band) < 4;
            if (edge || j % 20 == 0)
                check_row(&t, &layer, j);
        }
    }
    free_tables(&t);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(every_cell_of_a_large_arena_expects_its_own_sub_poses)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
