/* No filter allocates after its start, none is made by halves, and none leaves memory behind. */
#include "count_allocations.h"
#include "near.h"
#include "rooms.h"
#include "wander.h"

/* Followed, carried off, lost and found: every state that a filter has. */
static void run(struct nav_filter *f, struct wander *w)
{
    static struct nav_component list[20000];
    struct nav_estimate e;
    for (int k = 0; k < 400; k++) {
        if (k == 150)
            w->pose = (struct nav_pose){0.4, 0.4, 2.5};
        nav_filter_step(f, wander_on(w), &e);
        if (k % 50 == 0)
            nav_filter_components(f, list, sizeof list / sizeof list[0]);
    }
}

static void no_filter_allocates_after_its_start(void **state)
{
    (void)state;
    static const struct nav_component narrow[] = {{{1.0, 1.0, 0.5}, 0.02, 0.05, 3.0}, {{1.5, 0.5, 0.0}, 0.1, 0.2, 1.0}};
    static const struct nav_component wide[] = {{{1.0, 1.0, 0.5}, 0.5, 2.0, 1.0}};
    static const struct nav_prior priors[] = {{.mean = {1.0, 1.0, 0.5}, .sigma = {0.02, 0.02, 0.03}},
                                              {.uniform = true},
                                              {.component = narrow, .components = 2},
                                              {.component = wide, .components = 1}};
    for (size_t kind = 0; kind < sizeof priors / sizeof priors[0]; kind++) {
        for (int n = 0; nav_filter_name(n); n++) {
            struct wander w = wander_new(5);
            w.problem.prior = priors[kind];
            allocations = 0;
            struct nav_filter *f = nav_filter_new(nav_filter_name(n), &w.problem);
            assert_true(f && allocations > 0); /* they are seen */
            allocations = 0;
            run(f, &w);
            assert_int_equal(allocations, 0);
            nav_filter_free(f);
        }
    }
}

/* Whether something was made although an allocation failed; what was made is freed, and nothing may be left. */
static bool made_filter(const char *name, const struct nav_problem *problem)
{
    struct nav_filter *f = nav_filter_new(name, problem);
    nav_filter_free(f);
    return f;
}

static void starve(const char *name, const struct nav_problem *problem)
{
    bool whole = false;
    for (long fails = 1; !whole; fails++) {
        allocations = blocks = 0;
        failed_allocation = fails;
        whole = made_filter(name, problem);
        failed_allocation = 0;
        assert_int_equal(whole, allocations < fails);
        assert_int_equal(blocks, 0);
    }
}

static void what_gets_no_memory_is_not_made_and_leaves_nothing_behind(void **state)
{
    (void)state;
    static const struct nav_component components[] = {{{0.3, 0.4, 0.5}, 0.02, 0.05, 3.0},
                                                      {{0.5, 0.5, 0.0}, 0.1, 0.2, 1.0}};
    struct nav_problem p = room();
    p.prior = (struct nav_prior){.component = components, .components = 2};
    for (int n = 0; nav_filter_name(n); n++)
        starve(nav_filter_name(n), &p);
}

/* What there is none of (whiskers, boxes, free places) is no lack of memory. */
static void a_problem_without_whiskers_boxes_or_free_places_is_taken(void **state)
{
    (void)state;
    static const struct nav_box all = {0.0, 0.0, 1.0, 1.0};
    for (int kind = 0; kind < 3; kind++) {
        struct nav_problem p = room();
        p.arena.boxes = kind == 0 ? 0 : 1;
        p.arena.box = kind == 2 ? &all : ROOM_BOX;
        p.robot.tips = p.robot.rays = kind == 1 ? 0 : 1;
        for (int n = 0; nav_filter_name(n); n++)
            assert_true(made_filter(nav_filter_name(n), &p));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(no_filter_allocates_after_its_start),
        cmocka_unit_test(what_gets_no_memory_is_not_made_and_leaves_nothing_behind),
        cmocka_unit_test(a_problem_without_whiskers_boxes_or_free_places_is_taken),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
