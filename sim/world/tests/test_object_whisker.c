#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <stdlib.h>

#include "object_whisker.h"
#include "robot.h"

#define WHISK_STEP (SIM_PI / 24 * SIM_TICK_S) /* rad per tick of a body whisk */
#define GAP 0.0021                            /* rad between whisker and post at rest */
#define CENTRE 2.0

/* Which way this whisker's side is: turning left (+1) or right (-1) presses it away from the robot's centre. */
static int outward(const struct sim_whisker *mount)
{
    return mount->y * cos(mount->yaw) - mount->x * sin(mount->yaw) > 0 ? 1 : -1;
}

/* The robot just short of a post whose corner this whisker will meet at radius. At contact the whisker points 10
 * degrees out of the direction of x; the post reaches from the corner back along it. */
static struct sim_scene post_at(const struct sim_whisker *mount, double radius)
{
    int side = outward(mount);
    double towards = side * 10 * SIM_DEGREE, heading = towards - mount->yaw, size = 0.03;
    struct sim_scene scene = bench(2 * CENTRE, CENTRE, CENTRE, heading - side * GAP);
    double c = cos(heading), s = sin(heading);
    double x = CENTRE + c * mount->x - s * mount->y + radius * cos(towards);
    double y = CENTRE + s * mount->x + c * mount->y + radius * sin(towards);
    scene.obstacles = 1;
    scene.obstacle[0] =
        side > 0 ? (struct sim_box){x - size, y, x, y + size, NULL} : (struct sim_box){x - size, y - size, x, y, NULL};
    return scene;
}

static struct sim_pose turned(struct sim_pose pose, double angle)
{
    pose.theta += angle;
    return pose;
}

static struct sim_pose moved(struct sim_pose pose, double x, double y)
{
    pose.x += x;
    pose.y += y;
    return pose;
}

/* Turns by angle in steps no larger than a body whisk's; returns the pose after. */
static struct sim_pose turn(struct sim_object_whisker *whisker, const struct sim_scene *scene, struct sim_pose pose,
                            double angle)
{
    int steps = (int)ceil(fabs(angle) / WHISK_STEP);
    for (int i = 0; i < steps; i++) {
        struct sim_pose next = turned(pose, angle / steps);
        sim_object_whisker_move(whisker, scene, pose, next);
        pose = next;
    }
    return pose;
}

static struct sim_pose shift(struct sim_object_whisker *whisker, const struct sim_scene *scene, struct sim_pose pose,
                             double x, double y, int steps)
{
    for (int i = 0; i < steps; i++) {
        struct sim_pose next = moved(pose, x / steps, y / steps);
        sim_object_whisker_move(whisker, scene, pose, next);
        pose = next;
    }
    return pose;
}

static struct sim_object_whisker start(const struct sim_scene *scene, size_t lane, uint64_t seed)
{
    struct sim_object_whisker whisker;
    assert_true(sim_object_whisker_start(&whisker, scene, (uint32_t)lane, lane, sim_rng_stream(seed, 2, (uint32_t)lane),
                                         sim_rng_stream(seed, 3, (uint32_t)lane)));
    return whisker;
}

/* Whisker physics, section 2: a whisker perpendicular to its lever arm is pushed by the angle the body turns. */
static void test_theta_is_the_angle_turned(void **state)
{
    (void)state;
    struct sim_scene robot = bench(4, 2, 2, 0);
    for (size_t lane = 0; lane < 4; lane++) {
        for (double radius = 0.09; radius < 0.139; radius += 0.01) {
            struct sim_scene scene = post_at(&robot.whisker[lane], radius);
            struct sim_object_whisker whisker = start(&scene, lane, 1);
            int side = outward(&whisker.mount);
            struct sim_pose pose = turn(&whisker, &scene, scene.start, side * (GAP + 5 * SIM_DEGREE));
            assert_true(whisker.contact.touching && whisker.contact.corner);
            assert_near(whisker.contact.radius_m, radius, 2e-5);
            assert_near(whisker.contact.theta_rad, side * 5 * SIM_DEGREE, 1.5 * WHISK_STEP);
            pose = turn(&whisker, &scene, pose, -side * (5 * SIM_DEGREE - 3 * WHISK_STEP));
            assert_near(whisker.contact.theta_rad, 0, 4 * WHISK_STEP);
            turn(&whisker, &scene, pose, -side * GAP);
            assert_false(whisker.contact.touching);
            assert_near(whisker.contact.theta_rad, 0, 0);
        }
    }
}

static void test_turning_there_and_back_is_reversible(void **state)
{
    (void)state;
    struct sim_scene robot = bench(4, 2, 2, 0), scene = post_at(&robot.whisker[1], 0.11);
    struct sim_object_whisker whisker = start(&scene, 1, 1);
    struct sim_pose pose = turn(&whisker, &scene, scene.start, GAP + 1 * SIM_DEGREE);
    double before = whisker.contact.theta_rad;
    pose = turn(&whisker, &scene, pose, 4 * SIM_DEGREE);
    turn(&whisker, &scene, pose, -4 * SIM_DEGREE);
    assert_near(whisker.contact.theta_rad, before, 1e-12);
}

/* Tilt of the typical whisker at its contact, by the closed form. */
static double tilt_of(const struct sim_object_whisker *whisker)
{
    const struct mech_whisker typical = mech_whisker_default();
    const struct sim_contact *contact = &whisker->contact;
    return mech_whisker_tilt(&typical, contact->radius_m, contact->amplitude_gain * contact->theta_rad);
}

/* A wall met head on by the tip, driving straight into it. */
static void test_tip_on_a_wall(void **state)
{
    (void)state;
    struct sim_scene scene = bench(4, 2, 2, 0);
    struct sim_object_whisker whisker = start(&scene, 1, 1); /* tip at 20 degrees, pointing right of forward */
    double reach = whisker.mount.x + whisker.mount.length_m * cos(whisker.mount.yaw), depth = 0.02;
    struct sim_pose pose = scene.start;
    pose.x = 4 - reach - 1e-5;
    pose = shift(&whisker, &scene, pose, depth + 1e-5, 0, 1000);
    assert_true(whisker.contact.touching && !whisker.contact.corner);
    assert_near(whisker.contact.radius_m, 0.14, 0);
    /* The wall is on the left of a whisker that points to the right. */
    double sine = fabs(sin(whisker.mount.yaw));
    assert_near(whisker.contact.theta_rad, depth / sine / 0.14, 3e-5 / sine / 0.14);
    shift(&whisker, &scene, pose, -depth - 1e-4, 0, 1000);
    assert_false(whisker.contact.touching);
}

/* Largest difference between the tilts of two whiskers that are pushed into their walls and then driven along them. */
static double apart_along(struct sim_scene scene, const struct sim_floor_texture *one,
                          const struct sim_floor_texture *two)
{
    const struct sim_floor_texture *wall[2] = {one, two};
    double tilt[2][1000], apart = 0;
    for (int n = 0; n < 2; n++) {
        scene.wall = wall[n];
        struct sim_object_whisker whisker = start(&scene, 1, 1);
        struct sim_pose pose = scene.start;
        pose.x = 4 - whisker.mount.x - whisker.mount.length_m * cos(whisker.mount.yaw) - 1e-5;
        pose = shift(&whisker, &scene, pose, 0.01, 0, 1000);
        for (int i = 0; i < 1000; i++) {
            pose = shift(&whisker, &scene, pose, 0, 5e-5, 1);
            sim_object_whisker_bend(&whisker, 0);
            tilt[n][i] = whisker.shaft.tilt;
        }
        assert_true(whisker.contact.touching && !whisker.contact.corner);
    }
    for (int i = 0; i < 1000; i++)
        apart = fmax(apart, fabs(tilt[0][i] - tilt[1][i]));
    return apart;
}

/* A tip that slides along a face follows the heights of its texture; a shaft on a corner knows nothing of it. */
static void test_a_face_has_a_texture(void **state)
{
    (void)state;
    struct sim_scene scene = bench(4, 2, 2, 0);
    const struct sim_floor_texture *vinyl = mech_floor_texture("VINYL"), *rough = mech_floor_texture("ROUGH");
    assert_near(apart_along(scene, NULL, NULL), 0, 0);
    double little = apart_along(scene, NULL, vinyl), much = apart_along(scene, NULL, rough);
    assert_true(little > 1e-5 && much > 4 * little && much < 0.02);
    struct sim_scene post = post_at(&scene.whisker[1], 0.11);
    post.obstacle[0].surface = rough;
    struct sim_object_whisker whisker = start(&post, 1, 1);
    whisker.surface = rough; /* of an earlier contact */
    turn(&whisker, &post, post.start, GAP + 1 * SIM_DEGREE);
    assert_true(whisker.contact.corner && whisker.surface == NULL);
}

/* Pushed almost along its own axis the whisker would have to turn without end: the sine is limited. */
static void test_axial_push_is_limited(void **state)
{
    (void)state;
    struct sim_scene scene = bench(4, 2, 2, 0);
    struct sim_object_whisker whisker = start(&scene, 1, 1);
    struct sim_pose pose = {4 - 0.3, 2, -whisker.mount.yaw}; /* now it points straight at the wall */
    double base = cos(pose.theta) * whisker.mount.x - sin(pose.theta) * whisker.mount.y;
    pose.x = 4 - base - 0.14 - 1e-6;
    shift(&whisker, &scene, pose, 0.01, 0, 1000);
    assert_near(fabs(whisker.contact.theta_rad), 0.01 / 0.25 / 0.14, 1e-3);
}

/* A point of the whisker's undeformed segment with the robot at the scene's start, heading 0. */
static struct sim_point on_segment(const struct sim_scene *scene, const struct sim_whisker *mount, double radius)
{
    return (struct sim_point){scene->start.x + mount->x + radius * cos(mount->yaw),
                              scene->start.y + mount->y + radius * sin(mount->yaw)};
}

static void test_tip_on_a_face_near_its_corner(void **state)
{
    (void)state;
    struct sim_scene scene = bench(4, 2, 2, 0);
    struct sim_object_whisker whisker = start(&scene, 1, 1);
    struct sim_point tip = on_segment(&scene, &whisker.mount, 0.14);
    scene.obstacles = 1;
    scene.obstacle[0] = (struct sim_box){tip.x + 0.001, tip.y - 0.005, tip.x + 0.5, tip.y + 0.5, NULL};
    shift(&whisker, &scene, scene.start, 0.005, 0, 50);
    assert_true(whisker.contact.touching && !whisker.contact.corner);
    assert_near(whisker.normal.x, 1, 0);
}

static void test_shaft_on_a_corner_near_its_tip(void **state)
{
    (void)state;
    struct sim_scene scene = bench(4, 2, 2, 0);
    struct sim_object_whisker whisker = start(&scene, 1, 1); /* points forward and to the right */
    struct sim_point under = on_segment(&scene, &whisker.mount, 0.135);
    double x = -sin(whisker.mount.yaw), y = cos(whisker.mount.yaw); /* the whisker's left */
    scene.obstacles = 1;
    scene.obstacle[0] = (struct sim_box){under.x + 1e-4 * x, under.y + 1e-4 * y, under.x + 0.5, under.y + 0.5, NULL};
    shift(&whisker, &scene, scene.start, 0.002 * x, 0.002 * y, 20);
    assert_true(whisker.contact.touching && whisker.contact.corner);
    assert_near(whisker.contact.radius_m, 0.135, 1e-9);
    assert_near(whisker.contact.theta_rad, 0.0019 / 0.135, 0.0001 / 0.135);
}

/* Driving on, the shaft slides along the corner until the tip is past it. */
static void test_slides_off_a_corner(void **state)
{
    (void)state;
    struct sim_scene robot = bench(4, 2, 2, 0), scene = post_at(&robot.whisker[1], 0.12);
    struct sim_object_whisker whisker = start(&scene, 1, 1);
    struct sim_pose pose = turn(&whisker, &scene, scene.start, GAP + 2 * SIM_DEGREE);
    assert_true(whisker.contact.touching);
    shift(&whisker, &scene, pose, -0.08, 0, 800);
    assert_false(whisker.contact.touching);
    assert_near(whisker.contact.theta_rad, 0, 0);
}

/* A contact pushes and never pulls, whatever path led out of it. */
static void test_contact_is_one_sided(void **state)
{
    (void)state;
    struct sim_scene robot = bench(4, 2, 2, 0), scene = post_at(&robot.whisker[1], 0.11);
    struct sim_object_whisker whisker = start(&scene, 1, 1);
    struct sim_pose pose = turned(scene.start, GAP + 2 * SIM_DEGREE);
    whisker.side = 1;
    whisker.contact = (struct sim_contact){true, true, 0.11, 0.5 * SIM_DEGREE, 1};
    turn(&whisker, &scene, pose, -1 * SIM_DEGREE);
    assert_true(whisker.contact.touching);
    assert_near(whisker.contact.theta_rad, 0, 0);
}

/* A whisker that touches from the start has no history: the face its shaft enters, theta 0. */
static void test_touching_from_the_start(void **state)
{
    (void)state;
    struct sim_scene scene = bench(4, 3.85, 2, 0);
    struct sim_object_whisker whisker = start(&scene, 1, 1);
    sim_object_whisker_move(&whisker, &scene, scene.start, scene.start);
    assert_true(whisker.contact.touching && !whisker.contact.corner);
    assert_near(whisker.normal.x, 1, 0);
    assert_near(whisker.contact.theta_rad, 0, 0);
}

enum { RADII = 6, REPEATS = 1000 };

/* Peak tilt of repeated body whisks at 90..138 mm, in units of the angle turned. */
static void measure(size_t lane, double radius_mm[RADII * REPEATS], double feature[RADII * REPEATS])
{
    struct sim_scene robot = bench(4, 2, 2, 0);
    for (size_t i = 0; i < RADII; i++) {
        double radius = fmin(0.09 + 0.01 * (double)i, 0.138);
        struct sim_scene scene = post_at(&robot.whisker[lane], radius);
        struct sim_object_whisker whisker = start(&scene, lane, 10 + i);
        int side = outward(&whisker.mount);
        struct sim_pose pose = turned(scene.start, side * (GAP - 1e-6));
        for (size_t k = 0; k < REPEATS; k++) {
            struct sim_pose onset = turned(pose, side * 2e-6), push = turned(onset, side * 5 * SIM_DEGREE);
            sim_object_whisker_move(&whisker, &scene, pose, onset);
            sim_object_whisker_move(&whisker, &scene, onset, push);
            radius_mm[i * REPEATS + k] = radius * 1e3;
            feature[i * REPEATS + k] = fabs(tilt_of(&whisker)) / (5 * SIM_DEGREE);
            sim_object_whisker_move(&whisker, &scene, push, pose);
            assert_false(whisker.contact.touching);
        }
    }
}

/* Standard error of the least-squares line radius = a1 feature + a0. */
static double regression_error(size_t n, const double *radius, const double *feature)
{
    double mf = 0, mr = 0, ff = 0, fr = 0, rr = 0;
    for (size_t i = 0; i < n; i++) {
        mf += feature[i] / (double)n;
        mr += radius[i] / (double)n;
    }
    for (size_t i = 0; i < n; i++) {
        ff += (feature[i] - mf) * (feature[i] - mf);
        fr += (feature[i] - mf) * (radius[i] - mr);
        rr += (radius[i] - mr) * (radius[i] - mr);
    }
    return sqrt((rr - fr * fr / ff) / (double)(n - 2));
}

/* Whisker physics, section 4: sigma_r(a) = (Lc - a) rho, and the regression's standard error that follows for the
 * paper's spreads: 5.4, 2.7, 1.8, 4.2 mm. */
static void test_radial_noise_is_the_predicted_one(void **state)
{
    (void)state;
    const double spreads[] = SIM_WHISK_SPREADS, standard_errors[] = {5.4, 2.7, 1.8, 4.2};
    double *radius = malloc(RADII * REPEATS * sizeof *radius), *feature = malloc(RADII * REPEATS * sizeof *feature);
    assert_true(radius && feature);
    for (size_t lane = 0; lane < 4; lane++) {
        measure(lane, radius, feature);
        for (size_t i = 0; i < RADII; i++) {
            double cone_mm = SIM_WHISKER_CONE_M * 1e3, sum = 0;
            for (size_t k = i * REPEATS; k < (i + 1) * REPEATS; k++) {
                double estimate = cone_mm * (1 - feature[k]);
                sum += (estimate - radius[k]) * (estimate - radius[k]);
            }
            double predicted = (cone_mm - radius[i * REPEATS]) * spreads[lane];
            assert_near(sqrt(sum / REPEATS), predicted, 0.1 * predicted);
        }
        double error = regression_error(RADII * REPEATS, radius, feature);
        assert_near(error, standard_errors[lane], 0.1 * standard_errors[lane]);
    }
    free(radius);
    free(feature);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_theta_is_the_angle_turned),
        cmocka_unit_test(test_turning_there_and_back_is_reversible),
        cmocka_unit_test(test_tip_on_a_wall),
        cmocka_unit_test(test_a_face_has_a_texture),
        cmocka_unit_test(test_axial_push_is_limited),
        cmocka_unit_test(test_tip_on_a_face_near_its_corner),
        cmocka_unit_test(test_shaft_on_a_corner_near_its_tip),
        cmocka_unit_test(test_slides_off_a_corner),
        cmocka_unit_test(test_contact_is_one_sided),
        cmocka_unit_test(test_touching_from_the_start),
        cmocka_unit_test(test_radial_noise_is_the_predicted_one),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
