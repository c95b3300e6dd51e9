/* A filter begun from a mixture holds that mixture, and what is no mixture is refused. */
#include <string.h>

#include "mixture.h"
#include "near.h"
#include "rooms.h"
#include "wander.h"

enum { ROOM = 60000 };
static struct nav_component listed[ROOM];

/* Two components of unequal mass near each other, headings on both sides of the half turn. */
static const struct nav_component PAIR[] = {
    {{0.42, 0.46, 3.1}, 0.03, 0.1, 6.0},
    {{0.50, 0.56, -3.1}, 0.04, 0.15, 2.0},
};

static struct nav_problem begun_from(const struct nav_component *component, long count)
{
    struct nav_problem p = room();
    p.prior = (struct nav_prior){.component = component, .components = count};
    p.robot.body_radius = 0.01;
    return p;
}

struct moments {
    double mass, far, x, y, theta, xx, yy, tt;
};

/* Of what a filter lists within 0.35 m of a place, headings about `theta`; `far`: mass beyond. */
static struct moments moments_of(const struct nav_filter *f, struct nav_pose about)
{
    struct moments m = {.mass = 0.0};
    long count = nav_filter_components(f, listed, ROOM);
    assert_in_range(count, 1, ROOM);
    for (long n = 0; n < count; n++) {
        const struct nav_component *b = &listed[n];
        double dx = b->pose.x - about.x, dy = b->pose.y - about.y, turn = nav_wrap(b->pose.theta - about.theta);
        if (hypot(dx, dy) > 0.35 || fabs(turn) > 1.0) {
            m.far += b->mass;
            continue;
        }
        m.mass += b->mass;
        m.x += b->mass * dx;
        m.y += b->mass * dy;
        m.theta += b->mass * turn;
        m.xx += b->mass * (dx * dx + b->sigma_m * b->sigma_m);
        m.yy += b->mass * (dy * dy + b->sigma_m * b->sigma_m);
        m.tt += b->mass * (turn * turn + b->sigma_rad * b->sigma_rad);
    }
    return m;
}

/* Hand-worked: weights 3/4 and 1/4 of (0.42, 0.46, pi - 0.0416) and (0.50, 0.56, pi + 0.0416). */
static void every_filter_holds_the_mixture_that_it_begins_from(void **state)
{
    (void)state;
    const struct nav_pose mean = {0.44, 0.485, NAV_PI - 0.0416 + 0.25 * 0.0832};
    const double sx = sqrt(0.75 * (0.0009 + 0.0004) + 0.25 * (0.0016 + 0.0036));
    const double sy = sqrt(0.75 * (0.0009 + 0.000625) + 0.25 * (0.0016 + 0.005625));
    const double st = sqrt(0.75 * (0.01 + 0.0208 * 0.0208) + 0.25 * (0.0225 + 0.0624 * 0.0624));
    struct nav_problem p = begun_from(PAIR, 2);
    for (int n = 0; nav_filter_name(n); n++) {
        struct nav_filter *f = nav_filter_new(nav_filter_name(n), &p);
        assert_non_null(f);
        struct moments m = moments_of(f, mean);
        print_message("%s: mass %.4f, off %.4f %.4f %.4f, sigma %.4f %.4f %.4f\n", nav_filter_name(n), m.mass,
                      m.x / m.mass, m.y / m.mass, m.theta / m.mass, sqrt(m.xx / m.mass), sqrt(m.yy / m.mass),
                      sqrt(m.tt / m.mass));
        assert_near(m.mass + m.far, 1.0, 1e-4);
        assert_true(m.mass > 1.0 - 1.1 * NAV_ANYWHERE);
        assert_near(m.x / m.mass, 0.0, 0.006);
        assert_near(m.y / m.mass, 0.0, 0.006);
        assert_near(m.theta / m.mass, 0.0, 0.02);
        assert_near(sqrt(m.xx / m.mass), sx, 0.01);
        assert_near(sqrt(m.yy / m.mass), sy, 0.01);
        assert_near(sqrt(m.tt / m.mass), st, 0.03);
        nav_filter_free(f);
    }
}

/* Two places far apart: who can hold both does, with their shares. */
static void filters_of_many_places_hold_both_and_the_rest_of_the_arena(void **state)
{
    (void)state;
    const struct nav_component apart[] = {{{0.2, 0.2, 0.0}, 0.02, 0.1, 0.7}, {{0.7, 0.8, 2.0}, 0.02, 0.1, 0.3}};
    /* Of a few hundred particles: give or take three deviations of such a count. */
    const struct {
        const char *name;
        double share, rest;
    } many[] = {{"grid", 0.03, 0.004}, {"particle", 0.03, 3.0 * sqrt(NAV_ANYWHERE / 300.0)}, {"adaptive", 0.03, 0.004}};
    struct nav_problem p = begun_from(apart, 2);
    for (size_t n = 0; n < sizeof many / sizeof many[0]; n++) {
        struct nav_filter *f = nav_filter_new(many[n].name, &p);
        assert_near(moments_of(f, apart[0].pose).mass, 0.7, many[n].share);
        assert_near(moments_of(f, apart[1].pose).mass, 0.3, many[n].share);
        double rest = 1.0 - moments_of(f, apart[0].pose).mass - moments_of(f, apart[1].pose).mass;
        assert_near(rest, 0.9 * NAV_ANYWHERE, many[n].rest);
        nav_filter_free(f);
    }
}

/* A mixture over all of the arena is no cloud's: the histogram takes it as it is. */
static void a_wide_mixture_stays_as_wide_in_the_adaptive_filter(void **state)
{
    (void)state;
    struct nav_component wide[64];
    for (int n = 0; n < 64; n++)
        wide[n] = (struct nav_component){{0.0625 + 0.125 * (n % 8), 0.0625 + 0.125 * (n / 8), 0.1 * n}, 0.06, 1.0, 1.0};
    struct nav_problem p = begun_from(wide, 64);
    struct nav_filter *f = nav_filter_new("adaptive", &p);
    struct moments m = {.mass = 0.0};
    long count = nav_filter_components(f, listed, ROOM);
    for (long n = 0; n < count; n++) {
        m.mass += listed[n].mass;
        m.x += listed[n].mass * listed[n].pose.x;
        m.xx += listed[n].mass * (listed[n].pose.x - 0.5) * (listed[n].pose.x - 0.5);
    }
    assert_true(count > 10000); /* cells, not hypotheses */
    assert_near(m.mass, 1.0, 1e-4);
    assert_near(m.x, 0.5, 0.01);
    assert_near(sqrt(m.xx), 0.29, 0.02);
    nav_filter_free(f);
}

static void refused(struct nav_component bad, long at, const char *why)
{
    struct nav_component components[] = {PAIR[0], PAIR[1], PAIR[0]};
    struct nav_problem p = begun_from(components, 3);
    long which;
    components[2] = bad;
    const char *fault = nav_prior_fault(&p.arena, &p.prior, &which);
    assert_non_null(fault);
    assert_non_null(strstr(fault, why));
    assert_int_equal(which, at);
    for (int n = 0; nav_filter_name(n); n++)
        assert_null(nav_filter_new(nav_filter_name(n), &p));
}

static void what_is_no_mixture_is_refused(void **state)
{
    (void)state;
    const double nan = NAN, infinity = INFINITY;
    const double bad_widths[] = {0.0, -0.1, nan, infinity}, bad_masses[] = {-0.1, nan, infinity};
    struct nav_component b = PAIR[0];
    for (int n = 0; n < 4; n++) {
        b = PAIR[0];
        b.sigma_m = bad_widths[n];
        refused(b, 2, "width");
        b = PAIR[0];
        b.sigma_rad = bad_widths[n];
        refused(b, 2, "width");
    }
    for (int n = 0; n < 3; n++) {
        b = PAIR[0];
        b.mass = bad_masses[n];
        refused(b, 2, "mass");
    }
    b = PAIR[0];
    b.pose.theta = nan;
    refused(b, 2, "pose");
    b = PAIR[0];
    b.pose.x = 1.01;
    refused(b, 2, "outside");
    b.pose.x = 0.5;
    b.pose.y = -0.01;
    refused(b, 2, "outside");
}

static void counts_and_sums_are_checked_too(void **state)
{
    (void)state;
    static struct nav_component many[NAV_COMPONENTS_MOST + 1];
    long which;
    for (long n = 0; n <= NAV_COMPONENTS_MOST; n++)
        many[n] = PAIR[0];
    struct nav_problem p = begun_from(many, NAV_COMPONENTS_MOST);
    assert_null(nav_prior_fault(&p.arena, &p.prior, &which));
    p.prior.components = NAV_COMPONENTS_MOST + 1;
    assert_non_null(strstr(nav_prior_fault(&p.arena, &p.prior, &which), "too many"));
    p.prior.components = -1;
    assert_non_null(nav_prior_fault(&p.arena, &p.prior, &which));
    p.prior = (struct nav_prior){.components = 2};
    assert_non_null(nav_prior_fault(&p.arena, &p.prior, &which));
    many[0].mass = many[1].mass = 0.0;
    p.prior = (struct nav_prior){.component = many, .components = 2};
    assert_non_null(strstr(nav_prior_fault(&p.arena, &p.prior, &which), "no mass"));
    assert_int_equal(which, -1);
    assert_null(nav_filter_new("grid", &p));
    p.prior.uniform = true; /* then nobody reads them */
    assert_null(nav_prior_fault(&p.arena, &p.prior, &which));
}

/* Drawn poses, the density and the filled cells are of one distribution. */
static void draws_density_and_cells_agree(void **state)
{
    (void)state;
    enum { DRAWS = 20000 };
    struct nav_problem p = begun_from(PAIR, 2);
    struct nav_component own[2];
    struct nav_rng rng;
    double x = 0.0, inside = 0.0, integral = 0.0;
    memcpy(own, PAIR, sizeof own);
    nav_mixture_normalise(own, 2);
    p.prior.component = own;
    nav_rng_seed(&rng, 4, 0);
    for (int n = 0; n < DRAWS; n++) {
        struct nav_pose drawn = nav_mixture_draw(&p.prior, &rng);
        x += drawn.x / DRAWS;
        inside += (drawn.x < 0.45 && drawn.y < 0.5) / (double)DRAWS;
    }
    for (int k = 0; k < 2; k++)
        integral += own[k].mass * nav_normal_between(-1.0, 0.45, own[k].pose.x, own[k].sigma_m) *
                    nav_normal_between(-1.0, 0.5, own[k].pose.y, own[k].sigma_m);
    assert_near(x, 0.44, 0.002);
    assert_near(inside, integral, 0.01);
}

struct held {
    double x, y, cell, all, there;
};

/* Adds a cell; `there`: one of the four around (x, y), of the first heading. */
static void hold(void *self, struct nav_pose at, double mass)
{
    struct held *h = self;
    bool around = fabs(at.x - h->x) < h->cell && fabs(at.y - h->y) < h->cell;
    h->all += mass;
    h->there += around && at.theta > 0.0 && at.theta < NAV_PI / 2.0 ? mass : 0.0;
}

/* Whatever the cells' width in metres, a component's mass lies where the component is, and nothing but the doubt
 * at other places. */
static void cells_of_any_width_hold_their_share_of_a_component(void **state)
{
    (void)state;
    enum { CELLS = 20, HEADINGS = 4 };
    static const double widths[] = {0.01, 0.3, 1.0, 3.0};
    for (size_t n = 0; n < sizeof widths / sizeof widths[0]; n++) {
        double cell = widths[n];
        const struct nav_component component = {{14.0 * cell, 12.0 * cell, 1.0}, 0.2 * cell, 0.1, 1.0};
        const struct nav_levels levels = {CELLS * cell, CELLS * cell, cell, HEADINGS, 1};
        struct held held = {.x = component.pose.x, .y = component.pose.y, .cell = cell};
        struct nav_histogram h;
        assert_int_equal(nav_histogram_init(&h, &levels, 0, 0), 0);
        nav_mixture_fill(&(struct nav_prior){.component = &component, .components = 1}, &h);
        nav_histogram_each(&h, hold, &held);
        nav_histogram_free(&h);
        double all = held.all, there = held.there;
        assert_near(all, 1.0, 1e-5);
        assert_near(there, 1.0 - NAV_ANYWHERE, 1e-4);
    }
}

/* Begun at a wrong place, a filter that can be lost finds the robot: the doubt kept is enough. */
static void a_wrong_mixture_does_not_trap_who_can_recover(void **state)
{
    (void)state;
    static const char *const able[] = {"grid", "adaptive"};
    for (size_t n = 0; n < sizeof able / sizeof able[0]; n++) {
        struct wander w = wander_new(5);
        const struct nav_component wrong = {{1.5, 0.5, -2.0}, 0.02, 0.05, 1.0};
        struct nav_estimate e = {.confidence = 0.0};
        w.problem.prior = (struct nav_prior){.component = &wrong, .components = 1};
        struct nav_filter *f = nav_filter_new(able[n], &w.problem);
        assert_non_null(f);
        assert_true(hypot(w.pose.x - wrong.pose.x, w.pose.y - wrong.pose.y) > 0.3);
        for (int k = 0; k < 400; k++)
            nav_filter_step(f, wander_on(&w), &e);
        assert_near(hypot(e.pose.x - w.pose.x, e.pose.y - w.pose.y), 0.0, 0.1);
        nav_filter_free(f);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_filter_holds_the_mixture_that_it_begins_from),
        cmocka_unit_test(filters_of_many_places_hold_both_and_the_rest_of_the_arena),
        cmocka_unit_test(a_wide_mixture_stays_as_wide_in_the_adaptive_filter),
        cmocka_unit_test(what_is_no_mixture_is_refused),
        cmocka_unit_test(counts_and_sums_are_checked_too),
        cmocka_unit_test(draws_density_and_cells_agree),
        cmocka_unit_test(cells_of_any_width_hold_their_share_of_a_component),
        cmocka_unit_test(a_wrong_mixture_does_not_trap_who_can_recover),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
