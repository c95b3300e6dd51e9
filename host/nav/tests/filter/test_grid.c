/* The grid filter against equation 4 summed naively in double precision. The filter's own state is looked at, so its
 * source is part of this program. */
#include <string.h>

#include "../filter/grid.c"

#include "near.h"
#include "rooms.h"

enum { N = 10, H = 4, CELLS = N * N * H };
static const double CELL = 0.1;

/* Slices of 90 degrees head along the diagonals: driving one diagonal is a move by whole cells in every slice. */
static struct nav_problem diagonal_room(void)
{
    struct nav_problem p = room();
    p.settings.grid.cell_m = CELL;
    p.settings.grid.cell_deg = 90.0;
    p.settings.grid.sub = 1.0;
    p.settings.grid.sub_heading = 1.0;
    p.settings.motion.hazard = 0.0;
    p.settings.motion.drift_rad = 1.0; /* large enough for a heading blur in every row, */
    p.settings.motion.along_m = 0.1;   /* and for one blur in position */
    p.prior.sigma[0] = p.prior.sigma[1] = 0.2;
    p.prior.sigma[2] = 0.8;
    return p;
}

static struct nav_pose centre(int i, int j, int k)
{
    return (struct nav_pose){(i + 0.5) * CELL, (j + 0.5) * CELL, (k + 0.5) * NAV_PI / 2.0};
}

static double kernel(int offset, double share)
{
    return offset == 0 ? 1.0 - share : abs(offset) == 1 ? share / 2.0 : 0.0;
}

static int heading_offset(int a, int b)
{
    int d = ((a - b) % H + H) % H;
    return d == 3 ? -1 : d;
}

/* T(X | X0, o) of equation 4: one cell along each axis of the diagonal, a quarter turn, three-point noise per axis. A
 * motion that leads through a wall has no chance. */
static double transition(const int to[3], const int from[3], double share, double share_heading)
{
    static const int DX[] = {1, -1, -1, 1}, DY[] = {1, 1, -1, -1};
    int x = from[0] + DX[from[2]], y = from[1] + DY[from[2]];
    int turn = heading_offset(to[2], (from[2] + 1) % H);
    if (x < 0 || x >= N || y < 0 || y >= N)
        return 0.0;
    return kernel(to[0] - x, share) * kernel(to[1] - y, share) * kernel(turn, share_heading);
}

static double likelihood(const struct nav_problem *p, struct nav_likelihood *l, struct nav_pose pose)
{
    uint8_t codes[2];
    if (!nav_arena_free(&p->arena, pose.x, pose.y, 0.0))
        return 0.0;
    nav_likelihood_expect(l, &(struct nav_place){pose.x, pose.y, cos(pose.theta), sin(pose.theta)}, codes);
    return exp((double)summed(l, codes));
}

static void cell_of(int n, int at[3])
{
    at[0] = n % N;
    at[1] = n / N % N;
    at[2] = n / (N * N);
}

static void normalise(double *belief)
{
    double sum = 0.0;
    for (int n = 0; n < CELLS; n++)
        sum += belief[n];
    for (int n = 0; n < CELLS; n++)
        belief[n] /= sum;
}

/* Equation 4, all pairs of cells. */
static void naive_step(const struct nav_problem *p, struct nav_likelihood *l, double *belief, double share, double turn)
{
    static double next[CELLS];
    for (int n = 0; n < CELLS; n++) {
        int to[3], from[3];
        cell_of(n, to);
        next[n] = 0.0;
        for (int m = 0; m < CELLS; m++) {
            cell_of(m, from);
            next[n] += belief[m] * transition(to, from, share, turn);
        }
        next[n] *= likelihood(p, l, centre(to[0], to[1], to[2]));
    }
    memcpy(belief, next, sizeof next);
    normalise(belief);
}

struct cells {
    const struct nav_histogram *h;
    double *belief;
};

/* Adds a cell by its place and true heading: slices turn with the robot. Shifts are within half a cell. */
static void take_cell(void *self, struct nav_pose at, double mass)
{
    const struct cells *c = self;
    double heading = at.theta / (NAV_PI / 2.0);
    int k = (int)floor(heading - 4.0 * floor(heading / 4.0)), p = 0;
    while (fabs(nav_wrap(nav_histogram_heading(c->h, p) - at.theta)) > 1e-6)
        p++;
    int i = (int)lround((at.x - nav_histogram_shift_x(c->h, p)) / CELL - 0.5);
    int j = (int)lround((at.y - nav_histogram_shift_y(c->h, p)) / CELL - 0.5);
    c->belief[k * N * N + j * N + i] += mass / c->h->total;
}

static void by_heading(const struct grid *g, double *belief)
{
    struct cells cells = {&g->histogram, belief};
    memset(belief, 0, CELLS * sizeof *belief);
    nav_histogram_each(&g->histogram, take_cell, &cells);
}

static double total_variation(const double *a, const double *b)
{
    double sum = 0.0;
    for (int n = 0; n < CELLS; n++)
        sum += fabs(a[n] - b[n]) / 2.0;
    return sum;
}

static void the_grid_is_equation_4(void **state)
{
    (void)state;
    struct nav_problem p = diagonal_room();
    struct grid *g = grid_create(&p);
    static double naive[CELLS], fast[CELLS];
    by_heading(g, naive);
    const struct nav_motion motion = {.step = {CELL * sqrt(2.0), 0.0, NAV_PI / 2.0}};
    const struct nav_noise noise = nav_motion_noise(&p.robot, &p.settings, &motion);
    double d = CELL * sqrt(2.0), width = NAV_PI / 2.0;
    double share = (noise.position + width * width / 12.0 * d * d) / (CELL * CELL);
    double turn = noise.heading / (width * width);
    assert_true(share > 0.05 && share < 0.5 && turn > 0.05 && turn < 0.5); /* paid at once, in one pass */
    const double windows[3][2] = {{0.0, -30.0}, {-30.0, 0.0}, {0.0, -3.0}};
    const double distances[3] = {INFINITY, 0.12, 0.2}, fresh[] = {1.0, 1.0};
    for (int row = 0; row < 3; row++) {
        const double *reading[] = {windows[row], &distances[row]};
        grid_predict(g, &motion);
        grid_update(g, &(struct nav_evidence){.reading = reading, .weight = fresh});
        by_heading(g, fast);
        naive_step(&p, g->likelihood, naive, share, turn);
        assert_near(total_variation(naive, fast), 0.0, 1e-6);
    }
    grid_destroy(g);
}

static void motion_put_off_is_kept_exactly(void **state)
{
    (void)state;
    struct nav_problem p = room();
    p.robot.odometry_relative = 0.0;
    struct grid *g = grid_create(&p);
    struct nav_estimate before, after;
    const struct nav_motion step = {.step = {0.003, 0.0, 0.01}};
    struct nav_pose walked = g->mean;
    grid_estimate(g, &before);
    for (int i = 0; i < 30; i++) {
        grid_predict(g, &step);
        walked = nav_compose(walked, step.step);
    }
    grid_estimate(g, &after);
    assert_near(after.pose.x, walked.x, 1e-12);
    assert_near(after.pose.theta, walked.theta, 1e-12);
    assert_true(after.covariance[0] > before.covariance[0]);
    assert_near(g->histogram.rotation, 0.0, 0.0);
    grid_destroy(g);
}

static void belief_is_clipped_to_free_space(void **state)
{
    (void)state;
    struct nav_problem p = room();
    p.prior.mean = (struct nav_pose){0.95, 0.15, 0.0}; /* inside the box */
    struct grid *g = grid_create(&p);
    double inside = 0.0, all = 0.0;
    static struct nav_component cell[40000];
    long cells = grid_components(g, cell, 40000);
    for (long n = 0; n < cells; n++) {
        all += cell[n].mass;
        inside += cell[n].pose.x > 0.85 && cell[n].pose.y < 0.3 ? cell[n].mass : 0.0;
    }
    assert_near(all, 1.0, 1e-5);
    assert_near(inside, 0.0, 0.0);
    grid_destroy(g);
}

static void a_belief_with_no_room_left_starts_again_everywhere(void **state)
{
    (void)state;
    struct nav_problem p = room();
    p.settings.motion.hazard = 0.0;
    p.prior.sigma[0] = p.prior.sigma[1] = 0.01;
    p.prior.mean = (struct nav_pose){0.95, 0.15, 0.0};
    struct grid *g = grid_create(&p);
    struct nav_estimate out;
    grid_estimate(g, &out);
    assert_true(out.confidence < 0.2 && isfinite(out.pose.x));
    grid_destroy(g);
}

static void an_arena_without_a_free_place_is_survived(void **state)
{
    (void)state;
    static const struct nav_box all = {0.0, 0.0, 1.0, 1.0};
    struct nav_problem p = room();
    p.arena.box = &all;
    struct grid *g = grid_create(&p);
    const double nothing[] = {0.0, 0.0}, distance = 0.1, weight[] = {1.0, 1.0};
    const double *reading[] = {nothing, &distance};
    struct nav_estimate out;
    for (int i = 0; i < 3; i++)
        grid_update(g, &(struct nav_evidence){.reading = reading, .weight = weight});
    grid_estimate(g, &out);
    assert_true(isfinite(out.pose.x) && out.covariance[0] > 0.05 && out.confidence <= 0.0);
    grid_destroy(g);
}

static void a_wall_felt_ahead_puts_the_robot_before_it(void **state)
{
    (void)state;
    struct nav_problem p = room();
    p.prior.mean = (struct nav_pose){0.7, 0.6, 0.0};
    p.prior.sigma[2] = 0.05;
    struct grid *g = grid_create(&p);
    const double nothing[] = {0.0, 0.0}, distance = 0.1, weight[] = {0.0, 1.0};
    const double *reading[] = {nothing, &distance};
    grid_update(g, &(struct nav_evidence){.reading = reading, .weight = weight});
    struct nav_estimate out;
    grid_estimate(g, &out);
    /* Base 0.05 ahead of the centre, contact 0.1 further on, wall at 1: x = 0.85. The prior pulls it a little back. */
    assert_near(out.pose.x, 0.85, 0.02);
    assert_near(out.pose.y, 0.6, 0.03);
    grid_destroy(g);
}

/* Two floor whiskers over one texture, of which the first says the other one in every second window. */
static void a_floor_whisker_that_lies_is_found_out_whichever_way_the_robot_faces(void **state)
{
    (void)state;
    static const struct nav_tip tips[] = {{0.1, 0.1}, {0.1, -0.1}};
    static const struct nav_ray ray = {0.05, 0.0, 0.0, 0.1};
    const double right[] = {0.0, -10.0}, wrong[] = {-10.0, 0.0}, nothing = INFINITY, weight[] = {1.0, 1.0, 1.0};
    for (int n = 0; n < 8; n++) {
        struct nav_problem p = room();
        p.robot.tips = 2;
        p.robot.tip = tips;
        p.robot.ray = &ray;
        p.prior.mean = (struct nav_pose){0.25, 0.25, nav_wrap((n + 0.5) * NAV_PI / 4.0)};
        p.prior.sigma[0] = p.prior.sigma[1] = p.prior.sigma[2] = 0.03;
        struct grid *g = grid_create(&p);
        for (int row = 0; row < 40; row++) {
            const double *reading[] = {row % 2 ? wrong : right, right, &nothing};
            grid_update(g, &(struct nav_evidence){.reading = reading, .weight = weight});
        }
        assert_true(g->likelihood->trust[0].working < 0.1 && g->likelihood->trust[1].working > 0.9);
        grid_destroy(g);
    }
}

/* A slice's shift and the common rotation, to the nearest sub-pose. */
static double nearest(double value, double step)
{
    return step * floor(value / step + 0.5);
}

/* Mean over a cell's sub-poses, worked out from the arena itself. */
static double naive_cell(const struct grid *g, const struct nav_problem *p, int slice, int i, int j)
{
    const struct nav_histogram *h = &g->histogram;
    int sub = (int)p->settings.grid.sub, turns = (int)p->settings.grid.sub_heading;
    double step = CELL / sub, turn = h->shape.cell_theta / turns, sum = 0.0;
    for (int n = 0; n < sub * sub * turns; n++) {
        struct nav_pose pose = {
            i * CELL + (n % sub + 0.5) * step + nearest(nav_histogram_shift_x(h, slice), step),
            j * CELL + (n / sub % sub + 0.5) * step + nearest(nav_histogram_shift_y(h, slice), step),
            nav_histogram_heading(h, slice) - h->shape.cell_theta / 2.0 + (n / sub / sub + 0.5) * turn};
        pose.theta = (floor(pose.theta / turn) + 0.5) * turn; /* the table's headings */
        sum += likelihood(p, g->likelihood, pose) / (sub * sub * turns);
    }
    return sum;
}

static void a_cells_likelihood_is_the_mean_of_its_sub_poses_where_they_now_are(void **state)
{
    (void)state;
    struct nav_problem p = diagonal_room();
    p.prior.uniform = true;
    p.robot.body_radius = 0.01; /* the table's half step of grace exceeds it: free is what is outside walls and box */
    p.settings.grid.sub = 3.0;
    p.settings.grid.sub_heading = 2.0;
    struct grid *g = grid_create(&p);
    const double texture[] = {0.0, -50.0}, distance = 0.1, weight[] = {1.0, 1.0};
    const double *reading[] = {texture, &distance};
    for (int s = 0; s < H; s++) {
        g->histogram.shift_x[s] = 0.021 + 0.009 * s;
        g->histogram.shift_y[s] = -0.016 - 0.01 * s;
    }
    g->histogram.uniform = true;
    g->histogram.rotation = 0.3;
    grid_update(g, &(struct nav_evidence){.reading = reading, .weight = weight});
    double all = 0.0, worst = 0.0;
    static double belief[CELLS];
    by_heading(g, belief);
    for (int n = 0; n < 2 * CELLS; n++) {
        int at[3];
        cell_of(n % CELLS, at);
        double naive = naive_cell(g, &p, at[2], at[0], at[1]);
        if (n < CELLS)
            all += naive;
        else
            worst = fmax(worst, fabs(naive / all - belief[n - CELLS]));
    }
    assert_true(all > 1.0);
    assert_near(worst, 0.0, 1e-7);
    grid_destroy(g);
}

/* Every sixteenth row, and of a belief that is not everywhere alike. */
static void the_hazard_of_several_rows_is_given_at_once(void **state)
{
    (void)state;
    struct nav_problem p = room();
    struct grid *g = grid_create(&p);
    double sum = 0.0, cells = nav_shape_inside(&g->histogram.shape);
    for (int n = 1; n < NAV_HAZARD_ROWS; n++)
        sum += grid_hazard(g);
    assert_near(sum, 0.0, 0.0);
    assert_near(grid_hazard(g), NAV_HAZARD_ROWS * p.settings.motion.hazard / cells, 1e-15);
    grid_destroy(g);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_hazard_of_several_rows_is_given_at_once),
        cmocka_unit_test(the_grid_is_equation_4),
        cmocka_unit_test(a_cells_likelihood_is_the_mean_of_its_sub_poses_where_they_now_are),
        cmocka_unit_test(motion_put_off_is_kept_exactly),
        cmocka_unit_test(belief_is_clipped_to_free_space),
        cmocka_unit_test(a_belief_with_no_room_left_starts_again_everywhere),
        cmocka_unit_test(an_arena_without_a_free_place_is_survived),
        cmocka_unit_test(a_wall_felt_ahead_puts_the_robot_before_it),
        cmocka_unit_test(a_floor_whisker_that_lies_is_found_out_whichever_way_the_robot_faces),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
