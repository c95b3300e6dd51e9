/* Figures: a corner's place within 1 mm and its regions honest while it is swept at 0.1 m/s; the reported motion; bad
 * input counted. Contacts are bent by the table, which is itself tested against numbers of others. */
#include "contact_bank.h"
#include "contact_filter.h"
#include "contact_geometry.h"

#include <string.h>

#include "near.h"

#define CONE 0.181739
#define TICK 5e-4
#define NOISE 2e-4
#define DEGREE 0.017453292519943295

static struct nav_contact_beam beam;

static struct nav_contact_filter_config settings(void)
{
    return (struct nav_contact_filter_config){.cone_m = CONE,
                                              .kappa = 1.0,
                                              .creep = 0.0,
                                              .creep_s = 0.5,
                                              .noise_rad = NOISE,
                                              .largest_rad = 0.25,
                                              .gain_sd = 0.01,
                                              .model_share = 0.02,
                                              .friction = 0.3,
                                              .friction_sd = 0.05,
                                              .motion_share = 0.01,
                                              .ring_hz = 1000.0,
                                              .ring_damping = 0.0,
                                              .speed_sd = 0.15,
                                              .speed_drift = 0.005,
                                              .moving = 0.1,
                                              .caught = 0.02,
                                              .other = 0.1,
                                              .sample_s = TICK,
                                              .block = 20,
                                              .report = 2};
}

static struct nav_contact_filter_config without_friction(void)
{
    struct nav_contact_filter_config smooth = settings();
    smooth.friction = smooth.friction_sd = 0.0;
    return smooth;
}

/* Base moment in uN m of a clamped whisker, 2.5 GPa (elastica by shooting, and by a chain of 400 links). */
static void the_table_has_the_moments_of_others(void **state)
{
    (void)state;
    static const struct {
        double theta, a, arc, moment;
    } known[] = {
        {5, 90, 90.136, 521.529}, {10, 90, 90.553, 1024.307}, {10, 110, 110.877, 646.151}, {10, 120, 121.125, 503.142}};
    for (size_t i = 0; i < sizeof known / sizeof known[0]; i++) {
        struct nav_contact_bend bend;
        double low = 0.0, high = 1.2;
        for (int n = 0; n < 50; n++) {
            double slope = 0.5 * (low + high);
            nav_contact_beam_shaft(&beam, known[i].arc * 1e-3 / CONE, slope, 0.0, &bend);
            *(atan2(bend.y, bend.x) < known[i].theta * DEGREE ? &low : &high) = slope;
        }
        assert_near(1e3 * CONE * hypot(bend.x, bend.y), known[i].a, 0.01);
        assert_near(bend.moment * 3.572853e-4 / CONE * 1e6, known[i].moment, 2e-3 * known[i].moment);
    }
}

static void the_tables_meet_at_the_tip_and_have_derivatives(void **state)
{
    (void)state;
    struct nav_contact_bend at, next, shaft;
    for (double slope = 0.1; slope < 0.9; slope += 0.2) {
        double direction = slope + 90 * DEGREE - atan(0.2), h = 1e-3;
        assert_true(nav_contact_beam_end(&beam, direction, slope, &at));
        assert_true(nav_contact_beam_shaft(&beam, beam.tip, slope, 0.2, &shaft));
        assert_near(at.x, shaft.x, 1e-3);
        assert_near(at.moment, shaft.moment, 4e-3 * at.moment);
        nav_contact_beam_end(&beam, direction + h, slope, &next);
        assert_near((next.y - at.y) / h, at.by[0][1], 2e-3);
        nav_contact_beam_shaft(&beam, beam.tip - h, slope, 0.2, &next);
        assert_near((shaft.moment - next.moment) / h, shaft.by[0][2], 0.02 * fabs(shaft.by[0][2]) + 0.02);
    }
    assert_false(nav_contact_beam_shaft(&beam, 0.9, 0.1, 0.0, &at));
    assert_false(nav_contact_beam_make(&beam, NAN));
    assert_true(nav_contact_beam_make(&beam, 0.14 / CONE));
}

/* What a whisker meets: a circle (radius 0: a corner) with its centre at x, y, in m, and the sensor. */
struct object {
    double x, y, radius, friction, gain;
};

/* Tilt of the plug; the contact slides towards the tip. 0 when nothing is met. Writes the normal's direction. */
static double tilt_at(const struct object *o, double *normal)
{
    struct nav_contact_bend b = {0};
    double reach = (o->y + o->radius) / CONE, r = o->radius / CONE, arc = hypot(o->x, o->y + o->radius) / CONE;
    double slope = fmax(1e-6, 1.5 * reach), tilt = 0.0;
    for (int n = 0; n < 40 && reach > 0.0; n++) {
        nav_contact_beam_shaft(&beam, arc, slope, o->friction, &b);
        tilt = b.moment / 3.0;
        *normal = tilt + slope + 90 * DEGREE;
        double c = cos(tilt), s = sin(tilt), qx = c * b.x - s * b.y, qy = s * b.x + c * b.y, j[2][2];
        for (int k = 0; k < 2; k++) {
            double turn = b.by[k][2] / 3.0;
            j[0][k] = c * b.by[k][0] - s * b.by[k][1] - turn * qy + r * sin(*normal) * (turn + k);
            j[1][k] = s * b.by[k][0] + c * b.by[k][1] + turn * qx - r * cos(*normal) * (turn + k);
        }
        double ex = o->x / CONE - qx + r * cos(*normal), ey = o->y / CONE - qy + r * sin(*normal);
        double det = j[0][0] * j[1][1] - j[0][1] * j[1][0];
        arc += (ex * j[1][1] - ey * j[0][1]) / det;
        slope += (ey * j[0][0] - ex * j[1][0]) / det;
    }
    return o->gain * tilt;
}

/* Noise of unit deviation, repeatable: twelve uniform numbers. */
static double noise(uint32_t *seed)
{
    double sum = -6.0;
    for (int n = 0; n < 12; n++) {
        *seed = *seed * 1664525u + 1013904223u;
        sum += *seed / 4294967296.0;
    }
    return sum;
}

/* What base and object do, in the whisker's frame. */
struct course {
    struct object at;
    double base[3], object[2];
    double side; /* +1 or -1: the whisker may be met on either */
    uint32_t seed;
    double normal; /* of the surface, rad */
};

static struct object corner_at(double x)
{
    return (struct object){x, 0.0, 0.0, 0.3, 1.0};
}

/* Lets ticks pass; every `spoilt`-th sample is NAN. */
static void drive(struct nav_contact_filter *f, struct course *c, int ticks, int spoilt)
{
    for (int i = 0; i < ticks; i++) {
        double turn = -c->base[2] * TICK, x = c->at.x, y = c->at.y;
        c->at.x = x * cos(turn) - y * sin(turn) + (c->object[0] - c->base[0]) * TICK;
        c->at.y = x * sin(turn) + y * cos(turn) + (c->object[1] - c->base[1]) * TICK;
        double base[3] = {c->base[0], c->side * c->base[1], c->side * c->base[2]};
        double tilt[2] = {c->side * tilt_at(&c->at, &c->normal) + NOISE * noise(&c->seed), NOISE * noise(&c->seed)};
        if (spoilt > 0 && i % spoilt == 0)
            tilt[i % 2] = NAN;
        nav_contact_filter_update(f, base, tilt, true);
    }
}

static struct nav_contact_filter filter_of(struct nav_contact_filter_config config)
{
    struct nav_contact_filter f;
    nav_contact_filter_init(&f, &config, &beam);
    return f;
}

static struct nav_contact_filter filter(void)
{
    return filter_of(settings());
}

/* The answer is of the middle of the last block. */
static void expect_point(const struct nav_contact_filter *f, const struct course *c, double within)
{
    struct nav_contact_answer a;
    nav_contact_filter_answer(f, &a);
    double back = 10 * TICK, ex = a.point[0] - (c->at.x + (c->base[0] - c->object[0]) * back);
    double ey = a.point[1] - c->side * (c->at.y + (c->base[1] - c->object[1]) * back);
    assert_true(a.parts > 0);
    assert_near(hypot(ex, ey), 0.0, within);
    double det = a.point_cov[0][0] * a.point_cov[1][1] - a.point_cov[0][1] * a.point_cov[1][0];
    double far = (ex * ex * a.point_cov[1][1] - 2 * ex * ey * a.point_cov[0][1] + ey * ey * a.point_cov[0][0]) / det;
    assert_true(far < 9.2); /* the 99 % region */
    assert_true(sqrt(a.point_cov[0][0]) < within);
}

static void a_corner_that_is_driven_past_is_placed_on_either_side(void **state)
{
    (void)state;
    for (int side = -1; side <= 1; side += 2)
        for (double x = 0.07; x < 0.121; x += 0.025) {
            struct nav_contact_filter f = filter();
            struct course c = {corner_at(x), {-0.02, -0.1, 0.0}, {0}, side, 7, 0.0}; /* slides towards the tip */
            drive(&f, &c, 480, 0);
            expect_point(&f, &c, 1.5e-3);
            struct nav_contact_answer a;
            nav_contact_filter_answer(&f, &a);
            assert_int_equal(a.motion, NAV_CONTACT_DRIVE_BY);
            assert_true(a.corner > 0.5 && a.sweep < 0.1 && a.slip > 0.9 && a.tip < 0.1);
            assert_near(a.plane_rad, 0.0, 0.02);
        }
}

static void what_is_known_leaves_a_tenth_of_the_error(void **state)
{
    (void)state;
    struct nav_contact_filter_config known = settings();
    known.gain_sd = known.model_share = known.friction_sd = known.motion_share = 0.0;
    struct nav_contact_filter f = filter_of(known);
    struct course c = {corner_at(0.11), {-0.02, -0.1, 0.0}, {0}, 1, 23, 0.0};
    drive(&f, &c, 480, 0);
    expect_point(&f, &c, 0.3e-3);
}

static void a_gain_that_is_off_is_within_the_deviation(void **state)
{
    (void)state;
    struct nav_contact_filter_config loose = settings();
    loose.gain_sd = 0.04;
    struct nav_contact_filter f = filter_of(loose);
    struct course c = {corner_at(0.10), {-0.02, -0.1, 0.0}, {0}, 1, 29, 0.0};
    c.at.gain = 1.04;
    drive(&f, &c, 480, 0);
    expect_point(&f, &c, 3e-3);
}

static void a_cylinder_gives_its_contour_and_normal(void **state)
{
    (void)state;
    struct nav_contact_filter f = filter_of(without_friction());
    struct course c = {{0.1, -0.05, 0.05, 0.0, 1.0}, {0.0, -0.1, 0.0}, {0}, 1, 31, 0.0};
    drive(&f, &c, 480, 0);
    struct nav_contact_answer a;
    nav_contact_filter_answer(&f, &a);
    double x = c.at.x, y = c.at.y - 0.1 * 10 * TICK;
    assert_near(hypot(a.point[0] - x, a.point[1] - y), 0.05, 1e-3);
    assert_near(a.normal_rad, c.normal, 2 * DEGREE);
    assert_true(fabs(a.normal_rad - c.normal) < 4 * a.normal_sd);
    assert_true(a.normal_sd > 0.1 * DEGREE && a.normal_sd < 3 * DEGREE);
    assert_true(a.corner < 0.1);
}

static void a_body_whisk_is_reported_from_a_drive(void **state)
{
    (void)state;
    struct nav_contact_filter f = filter();
    struct course c = {corner_at(0.1), {0.0, 0.0, -7.5 * DEGREE}, {0}, 1, 3, 0.0};
    drive(&f, &c, 1600, 0);
    expect_point(&f, &c, 3e-3);
    struct nav_contact_answer a;
    nav_contact_filter_answer(&f, &a);
    assert_int_equal(a.motion, NAV_CONTACT_BODY_WHISK);
}

static void an_object_that_moves_is_reported_with_its_speed(void **state)
{
    (void)state;
    struct nav_contact_filter f = filter();
    struct course c = {corner_at(0.1), {0.0, 0.0, 0.0}, {0.0, 0.06}, 1, 5, 0.0};
    drive(&f, &c, 300, 0);
    c.base[1] = 0.04; /* the base retreats from it */
    drive(&f, &c, 260, 0);
    struct nav_contact_answer a;
    nav_contact_filter_answer(&f, &a);
    assert_int_equal(a.motion, NAV_CONTACT_SWEEP);
    assert_near(a.speed, 0.06, 0.012);
    assert_true(fabs(a.speed - 0.06) < 3.0 * a.speed_sd);
}

static void bad_samples_are_counted_and_not_read(void **state)
{
    (void)state;
    struct nav_contact_filter f = filter();
    struct course c = {corner_at(0.1), {0.0, -0.1, 0.0}, {0}, 1, 11, 0.0};
    drive(&f, &c, 480, 4);
    assert_int_equal(f.bad, 120);
    expect_point(&f, &c, 1.5e-3);
    const double still[3] = {0.0, 0.0, 0.0}, far[2] = {0.3, 0.0}, same[2] = {0.04, 0.0}, lost[3] = {NAN, 0.0, 0.0};
    for (int i = 0; i < 7; i++)
        nav_contact_filter_update(&f, still, far, true);
    assert_int_equal(f.saturated, 7);
    for (int i = 0; i < 100; i++)
        nav_contact_filter_update(&f, lost, same, true);
    assert_int_equal(f.stuck, 60); /* of 100 equal samples the first 40 are read */
    nav_contact_filter_update(&f, still, same, false);
    assert_int_equal(f.bad, 121);
}

static double uniform(uint32_t *seed)
{
    *seed = *seed * 1664525u + 1013904223u;
    return *seed / 4294967296.0;
}

static void whatever_comes_the_answers_are_finite(void **state)
{
    (void)state;
    uint32_t seed = 1;
    for (int n = 0; n < 40; n++) {
        struct nav_contact_filter f = filter();
        for (int i = 0; i < 600; i++) {
            double far = n % 5 == 0 ? 1e6 : 0.2, turn = n % 3 ? 1.0 : 1e5, size = n % 2 ? 0.3 : 1e-3 * i;
            double base[3] = {(uniform(&seed) - 0.5) * far, (uniform(&seed) - 0.5) * 0.2,
                              (uniform(&seed) - 0.5) * turn};
            double tilt[2] = {(uniform(&seed) - 0.3) * size, uniform(&seed) < 0.02 ? INFINITY : 0.01};
            struct nav_contact_answer a;
            if (!nav_contact_filter_update(&f, base, tilt, true))
                continue;
            nav_contact_filter_answer(&f, &a);
            double sum = a.point[0] + a.point[1] + a.arc_sd_m + a.plane_sd + a.normal_sd + a.speed_sd + a.friction_sd;
            assert_true(isfinite(sum) && a.point_cov[0][0] >= 0.0 && a.velocity_cov[1][1] >= 0.0);
            assert_in_range(1000.0 * (a.sweep + a.corner + a.tip + a.slip), 0, 4001);
        }
    }
}

static void what_only_rests_is_no_contact_and_a_new_one_begins_anew(void **state)
{
    (void)state;
    struct nav_contact_filter f = filter();
    struct nav_contact_answer a;
    struct course c = {{0.1, -1.0, 0.0, 0.3, 1.0}, {0.0, 0.0, 0.0}, {0}, 1, 13, 0.0};
    drive(&f, &c, 100, 0);
    nav_contact_filter_answer(&f, &a);
    assert_int_equal(a.parts, 0);
    c = (struct course){corner_at(0.12), {0.0, -0.1, 0.0}, {0}, 1, 13, 0.0};
    drive(&f, &c, 400, 0);
    nav_contact_filter_begin(&f);
    c = (struct course){corner_at(0.08), {0.0, -0.1, 0.0}, {0}, -1, 17, 0.0};
    drive(&f, &c, 400, 0);
    expect_point(&f, &c, 1.5e-3);
}

/* The tip on a face: it slides outwards, the force leans from the normal by friction's angle. */
static void a_face_under_the_tip_gives_its_normal(void **state)
{
    (void)state;
    double normal = 115 * DEGREE, nx = cos(normal), ny = sin(normal);
    struct nav_contact_filter f = filter();
    uint32_t seed = 19;
    double slope = 1e-3, pushed = 0.0;
    for (int i = 0; i < 600; i++) {
        struct nav_contact_bend b;
        double tilt = 0.0;
        pushed += 0.06 * TICK;
        for (int n = 0; n < 30; n++) { /* the slope at which the tip is on the face */
            for (int m = 0; m < 20; m++) {
                nav_contact_beam_end(&beam, normal + atan(0.3) - tilt, slope, &b);
                tilt = b.moment / 3.0;
            }
            double c = cos(tilt), s = sin(tilt), off = (c * b.x - s * b.y - beam.tip) * nx + (s * b.x + c * b.y) * ny;
            slope += (pushed / CONE - off) / (b.by[1][1] + beam.tip * b.by[1][2] / 3.0);
        }
        const double base[3] = {-0.06 * nx, -0.06 * ny, 0.0}, felt[2] = {tilt + NOISE * noise(&seed), 0.0};
        nav_contact_filter_update(&f, base, felt, true);
    }
    struct nav_contact_answer a;
    nav_contact_filter_answer(&f, &a);
    assert_true(a.tip > 0.9 && a.corner < 0.05 && a.slip > 0.9);
    assert_near(a.normal_rad, normal, 5 * DEGREE);
    assert_near(a.normal_rad, normal, 3 * a.normal_sd);
    assert_true(a.normal_sd < 8 * DEGREE);
    assert_near(a.arc_m, 0.14, 1e-3);
}

/* A contact at the tip whose direction lies `away` standard deviations from where it goes over to the shaft. */
static struct nav_contact_filter at_the_tip(double away)
{
    struct nav_contact_filter f = filter();
    struct nav_contact_part *part = &f.part[0];
    const struct nav_contact_step still = {.seconds = 0.01, .tilt = NAN, .variance = 1e-9};
    *part = (struct nav_contact_part){.tip = true, .grip = -1.0};
    part->s[SLOPE] = 0.2;
    part->s[FRICTION] = 0.3;
    part->s[FIRST] = 0.2 + 90 * DEGREE - atan(0.3) + 0.01 * away;
    part->p[FIRST][FIRST] = 1e-4;
    part->p[SLOPE][SLOPE] = part->p[FRICTION][FRICTION] = 1e-12;
    f.part[1] = (struct nav_contact_part){.other = true, .log_weight = -30.0};
    f.parts = 2;
    f.side = 1.0;
    nav_contact_bank_step(&f, &still);
    return f;
}

static void the_part_of_a_hypothesis_beyond_the_tip_goes_over_to_the_shaft(void **state)
{
    (void)state;
    struct nav_contact_filter f = at_the_tip(0.0);
    assert_int_equal(f.parts, 3);
    const struct nav_contact_part *stays = &f.part[0], *goes = &f.part[2];
    assert_true(stays->tip && !goes->tip);
    assert_near(exp(stays->log_weight), 0.5, 1e-3);
    assert_near(exp(goes->log_weight), 0.5, 1e-3);
    assert_near(goes->s[FIRST], beam.tip, 2e-3);
    assert_near(stays->s[FIRST], 0.2 + 90 * DEGREE - atan(0.3) + 0.01 * 0.798, 1e-5); /* a half normal's mean ... */
    assert_near(stays->p[FIRST][FIRST], 1e-4 * 0.363, 1e-6);                          /* ... and variance */
    f = at_the_tip(3.0);
    assert_true(f.parts == 2 && f.part[0].tip);
    f = at_the_tip(-3.0);
    assert_true(f.parts == 2 && !f.part[0].tip && !f.part[0].other);
    f = at_the_tip(1.0);
    assert_int_equal(f.parts, 3);
    assert_near(exp(f.part[2].log_weight), 0.1587, 1e-3);
}

/* The tip on a face of 130 degrees, over which the base moves on by 0.7 mm. */
static struct nav_contact_filter after_a_block(struct nav_contact_part tip)
{
    struct nav_contact_filter f = filter();
    struct nav_contact_bend b;
    struct nav_contact_part *part = &f.part[0];
    *part = tip;
    part->s[SLOPE] = 0.2;
    part->s[FIRST] = 130 * DEGREE + atan(part->s[FRICTION]);
    part->p[FIRST][FIRST] = part->p[SLOPE][SLOPE] = 1e-6;
    nav_contact_beam_end(&beam, part->s[FIRST], part->s[SLOPE], &b);
    f.parts = 1;
    f.side = 1.0;
    const struct nav_contact_step step = {
        .moved = {0.0005, -0.0005}, .seconds = 0.01, .tilt = b.moment / 3.0, .variance = 1e-6};
    nav_contact_bank_step(&f, &step);
    return f;
}

static void a_face_under_the_tip_may_end_in_proportion_to_the_way(void **state)
{
    (void)state;
    struct nav_contact_filter f =
        after_a_block((struct nav_contact_part){.tip = true, .grip = 1.0, .s[FRICTION] = 0.3});
    assert_int_equal(f.parts, 2);
    assert_true(f.part[0].tip && f.part[1].corner && !f.part[1].tip);
    assert_near(exp(f.part[1].log_weight), 0.0005 * sqrt(2.0) / 0.2, 1e-4);
    assert_near(f.part[1].s[FIRST], beam.tip, 5e-3);
}

static void a_tip_that_chatters_rubs_either_way_while_it_slides_outwards(void **state)
{
    (void)state;
    struct nav_contact_part tip = {.tip = true, .hops = true, .grip = 1.0, .s[FRICTION] = -0.2};
    struct nav_contact_filter f = after_a_block(tip);
    assert_true(f.part[0].hops && f.part[0].slips);
    assert_near(f.part[0].grip, 1.0, 1e-12);
    assert_near(f.part[0].s[FRICTION], -0.2, 0.02);
    double least = (0.3 * 0.3 + 0.05 * 0.05) / 3.0 * 0.03; /* the way over 36 mm, twice, of the cone's variance */
    assert_in_range(1e6 * f.part[0].p[FRICTION][FRICTION], 1e6 * least, 2e6 * least);
    struct nav_contact_answer a;
    nav_contact_filter_answer(&f, &a);
    assert_near(a.friction, 0.3, 1e-6); /* the surface's, of which a mean says nothing */
}

/* Tilts of a whisker that buckles: they jump to and fro while the base moves on. */
static void what_no_hypothesis_explains_is_none_of_them(void **state)
{
    (void)state;
    struct nav_contact_filter f = filter();
    struct nav_contact_answer a;
    uint32_t seed = 23;
    for (int i = 0; i < 400; i++) {
        double t = i * TICK, tilt = 0.02 + 0.3 * t + 0.02 * sin(30.0 * t) * sin(30.0 * t);
        const double base[3] = {0.05, -0.001, 0.0}, felt[2] = {tilt + NOISE * noise(&seed), 0.0};
        nav_contact_filter_update(&f, base, felt, true);
    }
    nav_contact_filter_answer(&f, &a);
    assert_true(a.other > 0.5 && a.tip < 0.5);
}

/* The plug has come to rest when it is touched. */
static void a_base_that_shook_before_the_touch_leaves_no_ringing(void **state)
{
    (void)state;
    struct nav_contact_filter calm = filter(), shaken = filter();
    uint32_t seed = 37;
    for (int i = 0; i < 300; i++) {
        const double shake = i >= 160 ? 0.0 : i % 2 ? 0.1 : -0.1, touched = fmax(0.0, (i - 200) * TICK);
        const double still[3] = {0.0, -0.05, 0.0}, shakes[3] = {shake, -0.05, 0.0};
        const double felt[2] = {0.3 * touched + NOISE * noise(&seed), 0.0};
        nav_contact_filter_update(&calm, still, felt, true);
        nav_contact_filter_update(&shaken, shakes, felt, true);
    }
    assert_true(calm.parts > 0);
    assert_near(shaken.ring, calm.ring, 0.0);
}

/* A corner under the shaft is pressed, let go and pressed again 3 mm on; the gap between says nothing new of it. */
static void an_object_is_followed_over_a_gap(void **state)
{
    (void)state;
    const double place = 0.1, speed = 0.05;
    struct nav_contact_filter f = filter_of(without_friction());
    struct nav_contact_answer a, b;
    uint32_t seed = 29;
    double deep = 0.0;
    for (int i = 0; i < 2000; i++) {
        double way = i < 300 ? speed : i < 800 ? -speed : speed;
        deep += way * TICK;
        double slope = 0.0, tilt = 0.0;
        struct nav_contact_bend bend = {0};
        for (int n = 0; n < 30 && deep > 0.0; n++) {
            nav_contact_beam_shaft(&beam, place / CONE, slope, 0.0, &bend);
            tilt = bend.moment / 3.0;
            slope += (deep / CONE - bend.y - tilt * bend.x) / (bend.by[1][1] + bend.by[1][2] / 3.0 * bend.x);
        }
        const double base[3] = {0.0, -way, 0.0}, felt[2] = {tilt + NOISE * noise(&seed), 0.0};
        nav_contact_filter_update(&f, base, felt, true);
        if (i == 300)
            nav_contact_filter_answer(&f, &a);
        if (i == 900)
            assert_true(f.parts > 1);
    }
    nav_contact_filter_answer(&f, &b);
    assert_int_equal(f.restarts, 0);
    assert_true(b.tip < 0.1 && b.other < 0.1);
    assert_near(b.arc_m, place, 4e-3);
    assert_true(b.arc_sd_m < a.arc_sd_m);
}

/* A turn that draws the shaft along the object leaves it where it is on the shaft: it goes along. */
static void a_corner_that_goes_along_with_the_shaft_is_caught(void **state)
{
    (void)state;
    const double place = 0.1, turn = 0.13;
    struct nav_contact_filter f = filter_of(without_friction());
    uint32_t seed = 31;
    for (int i = 0; i < 1200; i++) {
        struct nav_contact_bend bend = {0};
        double slope = 0.0, tilt = 0.0, angle = turn * (i + 1) * TICK;
        for (int n = 0; n < 30; n++) {
            nav_contact_beam_shaft(&beam, place / CONE, slope, 0.0, &bend);
            tilt = bend.moment / 3.0;
            slope += (angle - atan2(bend.y, bend.x) - tilt) * bend.x / (bend.by[1][1] + bend.by[1][2] / 3.0 * bend.x);
        }
        const double base[3] = {-0.02, 0.0, -turn}, felt[2] = {tilt + NOISE * noise(&seed), 0.0};
        nav_contact_filter_update(&f, base, felt, true);
    }
    double caught = 0.0;
    struct nav_contact_answer a;
    for (int i = 0; i < f.parts; i++)
        caught += f.part[i].caught ? exp(f.part[i].log_weight) : 0.0;
    nav_contact_filter_answer(&f, &a);
    assert_true(caught > 0.9 && a.sweep < 0.1);
    assert_near(a.arc_m, place, 3e-3);
}

static void the_share_of_a_push_along_the_whisker_is_reported(void **state)
{
    (void)state;
    struct nav_contact_filter f = filter();
    struct nav_contact_answer a;
    for (int side = 1; side >= -1; side -= 2) {
        struct course c = {corner_at(0.11), {0.03 * side, -0.04, 0.0}, {0}, 1, 7, 0.0};
        drive(&f, &c, 200, 0);
        nav_contact_filter_answer(&f, &a);
        assert_near(a.along, side > 0 ? 0.6 : 0.0, 1e-6); /* drawn back, it does not push */
        nav_contact_filter_begin(&f);
    }
}

static void a_surface_reports_its_curvature(void **state)
{
    (void)state;
    struct nav_contact_filter f = filter_of(without_friction());
    struct course c = {{0.1, -0.05, 0.05, 0.0, 1.0}, {0.0, -0.1, 0.0}, {0}, 1, 31, 0.0};
    drive(&f, &c, 480, 0);
    struct nav_contact_answer a;
    nav_contact_filter_answer(&f, &a);
    assert_near(a.curvature, 20.0, 3.0 * a.curvature_sd);
    assert_true(a.curvature_sd > 0.01 && a.curvature_sd < 8.0);
}

int main(void)
{
    if (!nav_contact_beam_make(&beam, 0.14 / CONE))
        return 1;
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_table_has_the_moments_of_others),
        cmocka_unit_test(the_tables_meet_at_the_tip_and_have_derivatives),
        cmocka_unit_test(a_corner_that_is_driven_past_is_placed_on_either_side),
        cmocka_unit_test(what_is_known_leaves_a_tenth_of_the_error),
        cmocka_unit_test(a_gain_that_is_off_is_within_the_deviation),
        cmocka_unit_test(a_cylinder_gives_its_contour_and_normal),
        cmocka_unit_test(a_body_whisk_is_reported_from_a_drive),
        cmocka_unit_test(an_object_that_moves_is_reported_with_its_speed),
        cmocka_unit_test(a_face_under_the_tip_gives_its_normal),
        cmocka_unit_test(a_face_under_the_tip_may_end_in_proportion_to_the_way),
        cmocka_unit_test(a_tip_that_chatters_rubs_either_way_while_it_slides_outwards),
        cmocka_unit_test(the_part_of_a_hypothesis_beyond_the_tip_goes_over_to_the_shaft),
        cmocka_unit_test(what_no_hypothesis_explains_is_none_of_them),
        cmocka_unit_test(a_base_that_shook_before_the_touch_leaves_no_ringing),
        cmocka_unit_test(an_object_is_followed_over_a_gap),
        cmocka_unit_test(a_corner_that_goes_along_with_the_shaft_is_caught),
        cmocka_unit_test(the_share_of_a_push_along_the_whisker_is_reported),
        cmocka_unit_test(a_surface_reports_its_curvature),
        cmocka_unit_test(bad_samples_are_counted_and_not_read),
        cmocka_unit_test(whatever_comes_the_answers_are_finite),
        cmocka_unit_test(what_only_rests_is_no_contact_and_a_new_one_begins_anew),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
