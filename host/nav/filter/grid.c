/* The exact filter: equation 4 on a grid over the whole arena.
 *
 * A cell's likelihood is the mean over its sub-poses, so that a border that cuts a cell counts by its share. Where the
 * robot cannot stand the likelihood is 0. A cell that holds less than the hazard gives is dropped. Motion is put off
 * until something is read: one pass then does for several rows, and nothing is lost, since motions compose exactly. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "expected.h"
#include "filter.h"
#include "gaussian.h"
#include "histogram.h"
#include "likelihood.h"
#include "mixture.h"

static const double SURE = 0.5;   /* confidence from which a belief judges whiskers, */
static const double LIGHT = 1e-4; /* by cells with more mass than this */

/* Cells narrower than a belief's widest, at most: 50 bytes each with their tables. */
static const double CELLS_MOST = 2.5e6;

struct grid {
    const struct nav_problem *problem;
    struct nav_likelihood *likelihood;
    struct nav_cell wanted; /* cells that the scene asks for */
    struct nav_expected *expected;
    struct nav_histogram histogram;
    struct nav_weigh weigh;
    int slice;                  /* whose place in the tables is */
    struct nav_layer layer;     /* this */
    struct nav_pending pending; /* since the last update */
    struct nav_pose mean;       /* near the mode, at the last update */
    double near;                /* before the present row: from SURE on it judges its readings */
    bool sure;
    long unhazarded; /* rows read since the hazard was last given */
};

static void grid_destroy(void *self)
{
    struct grid *g = self;
    nav_likelihood_free(g->likelihood);
    nav_expected_free(g->expected);
    nav_histogram_free(&g->histogram);
    free(g);
}

/* Adds what a cell near the pose expected expects, before it is weighed; light ones are left out. */
static void grid_expect_cell(struct grid *g, int p, int line, int column, double mass)
{
    const struct nav_shape *s = &g->histogram.shape;
    if (mass <= LIGHT)
        return;
    double x = (column + 0.5) * s->cell + nav_histogram_shift_x(&g->histogram, p) - g->mean.x;
    double y = (line + 0.5) * s->cell + nav_histogram_shift_y(&g->histogram, p) - g->mean.y;
    int poses = g->expected->sub * g->expected->sub * g->expected->turns;
    double turn = nav_histogram_heading(&g->histogram, p) - g->mean.theta;
    if (hypot(x, y) > NAV_NEAR_M || fabs(nav_wrap(turn)) > NAV_NEAR_RAD)
        return;
    for (int n = 0; n < poses; n++) {
        const uint8_t *codes = nav_expected_codes(g->expected, &g->layer, line, column, n);
        if (codes)
            nav_trust_add(g->likelihood, codes, mass / poses);
    }
}

static long grid_weigh_group(void *self, int p, int line, int group, const float *mass, float *like)
{
    struct grid *g = self;
    const struct nav_histogram *h = &g->histogram;
    if (g->slice != p)
        g->layer = nav_expected_layer(g->expected, nav_histogram_heading(h, p), nav_histogram_shift_x(h, p),
                                      nav_histogram_shift_y(h, p));
    g->slice = p;
    nav_expected_mean(g->expected, &g->layer, line, group * NAV_LANES, mass, like);
    for (int k = 0; k < NAV_LANES && g->sure; k++)
        grid_expect_cell(g, p, line, group * NAV_LANES + k, (double)mass[k]);
    return 0;
}

/* What every cell is given of the chance that the robot was put there. */
static double grid_hazard(struct grid *g)
{
    double hazard = g->problem->settings.motion.hazard;
    if (++g->unhazarded < NAV_HAZARD_ROWS || g->histogram.uniform)
        return 0.0;
    g->unhazarded = 0;
    return NAV_HAZARD_ROWS * hazard / nav_shape_inside(&g->histogram.shape);
}

static double grid_prior(void *self, double x, double y)
{
    return nav_likelihood_prior(((struct grid *)self)->likelihood, x, y);
}

/* Moves, multiplies by the likelihood and normalises; `extra` is added to each cell first, by the prior of its place.
 * Returns false with no mass. */
static bool grid_reweigh(struct grid *g, struct nav_pose step, double extra)
{
    static const struct nav_weigh noise = {.group = NULL};
    enum { PASSES_MOST = 25 };
    struct nav_histogram *h = &g->histogram;
    for (int n = 0; n < PASSES_MOST && nav_histogram_debt(h) > 1.0 && h->total > 0.0; n++) {
        nav_histogram_pass(h, step, &noise, g->mean);
        step = (struct nav_pose){0.0, 0.0, 0.0};
    }
    if (!(h->total > 0.0))
        return false;
    double least = NAV_SHARE_LEAST / nav_shape_inside(&h->shape);
    g->weigh = (struct nav_weigh){.group = grid_weigh_group,
                                  .self = g,
                                  .least = g->problem->settings.motion.hazard > 0.0 ? least : 0.0,
                                  .extra = extra,
                                  .prior = grid_prior};
    g->slice = -1;
    nav_histogram_pass(h, step, &g->weigh, g->mean);
    return h->total > 0.0 && isfinite(h->total);
}

static void grid_summarise(struct grid *g)
{
    if (!(g->histogram.total > 0.0)) { /* no place in the arena is free: nothing can be known */
        g->mean = nav_gaussian_uniform(&g->problem->arena).mean;
        g->near = 0.0;
        return;
    }
    g->near = nav_histogram_mode(&g->histogram, &g->mean);
}

/* Likelihoods of the row last read, for a belief that is uniform or not. */
static void grid_expect(struct grid *g, bool uniform)
{
    g->expected->unmapped = uniform ? g->likelihood->ground.weight : 1.0;
    nav_expected_begin(g->expected, (const float *const *)g->likelihood->table, 0.0f);
    nav_expected_scale(g->expected);
}

/* Spreads the belief over free space, by what the present row says. */
static void grid_forget(struct grid *g)
{
    g->sure = false;
    grid_expect(g, true);
    nav_histogram_restart(&g->histogram, 0);
    grid_reweigh(g, (struct nav_pose){0.0, 0.0, 0.0}, 0.0);
}

/* The belief before anything is read: the tables say that all is equally likely. */
static void grid_begin(struct grid *g)
{
    const struct nav_prior *prior = &g->problem->prior;
    g->mean = prior->mean;
    grid_expect(g, prior->uniform);
    if (!prior->uniform)
        nav_mixture_fill(prior, &g->histogram);
    if (!grid_reweigh(g, (struct nav_pose){0.0, 0.0, 0.0}, 0.0))
        grid_forget(g);
    grid_summarise(g);
}

static bool grid_make_tables(struct grid *g)
{
    const struct nav_problem *problem = g->problem;
    const struct nav_settings *s = &problem->settings;
    const struct nav_shape *shape = &g->histogram.shape;
    int sub = (int)s->grid.sub, turns = (int)s->grid.sub_heading;
    double blur = nav_cell_blur(shape->cell, shape->cell_theta, g->wanted.lever, sub, turns);
    g->likelihood = nav_likelihood_new(&problem->arena, &problem->robot, s, blur);
    if (g->likelihood)
        g->expected = nav_expected_new(g->likelihood, shape->cell, shape->nh, sub, turns);
    return g->expected;
}

/* The scene's cells, or wider ones where these would be too many. */
static int grid_find_cell(struct grid *g, struct nav_cell *cell)
{
    const struct nav_arena *arena = &g->problem->arena;
    double given = g->problem->settings.grid.cell_m, area = arena->size_x * arena->size_y;
    int failed = nav_problem_cell(g->problem, 0.0, &g->wanted) || nav_problem_cell(g->problem, given, cell);
    while (!failed && given <= 0.0 && cell->edge < NAV_EDGE_MOST_M &&
           area / (cell->edge * cell->edge) * nav_cell_headings(cell) > CELLS_MOST)
        failed = nav_problem_cell(g->problem, fmin(2.0 * cell->edge, NAV_EDGE_MOST_M), cell);
    return failed;
}

static void *grid_create(const struct nav_problem *problem)
{
    const struct nav_settings *s = &problem->settings;
    struct grid *g = calloc(1, sizeof *g);
    if (!g)
        return NULL;
    g->problem = problem;
    struct nav_cell cell;
    bool found = grid_find_cell(g, &cell) == 0;
    cell.heading = s->grid.cell_deg > 0.0 ? s->grid.cell_deg * NAV_PI / 180.0 : cell.heading;
    const struct nav_levels levels = {.size_x = problem->arena.size_x,
                                      .size_y = problem->arena.size_y,
                                      .cell = cell.edge,
                                      .headings = nav_cell_headings(&cell)};
    if (!found || nav_histogram_init(&g->histogram, &levels, 0, 0) || !grid_make_tables(g)) {
        grid_destroy(g);
        return NULL;
    }
    grid_begin(g);
    return g;
}

/* NAV_CARRIED of the belief is anywhere: what every cell then gets is added in a pass without a likelihood. */
static void grid_carry(struct grid *g)
{
    const double each = NAV_CARRIED / (1.0 - NAV_CARRIED) / nav_shape_inside(&g->histogram.shape);
    const struct nav_weigh more = {.self = g, .extra = each, .prior = grid_prior};
    if (!(g->histogram.total > 0.0) || g->histogram.uniform)
        return;
    nav_histogram_pass(&g->histogram, (struct nav_pose){0.0, 0.0, 0.0}, &more, g->mean);
    g->near *= 1.0 - NAV_CARRIED;
}

static void grid_predict(void *self, const struct nav_motion *motion)
{
    struct grid *g = self;
    if (g->pending.noise.position > 0.0) /* nothing was read in the row before */
        g->near = nav_histogram_within(&g->histogram, &g->pending, nav_compose(g->mean, g->pending.step));
    struct nav_noise noise = nav_motion_noise(&g->problem->robot, &g->problem->settings, motion);
    noise.position += nav_histogram_fan(&g->histogram, motion->step, g->problem->settings.motion.along_m);
    nav_pending_add(&g->pending, motion->step, noise);
    if (motion->carried)
        grid_carry(g);
}

static void grid_update(void *self, const struct nav_evidence *evidence)
{
    struct grid *g = self;
    struct nav_pose step = g->pending.step;
    bool sure = g->sure = g->near >= SURE; /* fairly */
    g->histogram.pending_position += g->pending.noise.position;
    g->histogram.pending_heading += g->pending.noise.heading;
    g->mean = nav_compose(g->mean, step);
    g->pending = (struct nav_pending){.step = {0.0, 0.0, 0.0}};
    nav_likelihood_read(g->likelihood, evidence);
    grid_expect(g, false);
    nav_trust_begin(g->likelihood);
    if (!grid_reweigh(g, step, grid_hazard(g)))
        grid_forget(g);
    if (sure)
        nav_trust_learn(g->likelihood);
    grid_summarise(g);
}

static void grid_estimate(const void *self, struct nav_estimate *out)
{
    const struct grid *g = self;
    out->pose = nav_compose(g->mean, g->pending.step);
    out->pose.theta = nav_wrap(out->pose.theta);
    if (g->histogram.total > 0.0)
        nav_histogram_covariance(&g->histogram, &g->pending, out->pose, out->covariance);
    else
        memcpy(out->covariance, nav_gaussian_uniform(&g->problem->arena).covariance, sizeof out->covariance);
    out->confidence = nav_histogram_within(&g->histogram, &g->pending, out->pose);
    out->states = out->touched = out->evaluations = (long)nav_shape_inside(&g->histogram.shape);
    out->distinct = (long)g->expected->knowns;
    out->bytes = sizeof *g + nav_histogram_bytes(&g->histogram) + nav_expected_bytes(g->expected);
}

static long grid_components(const void *self, struct nav_component *out, long room)
{
    const struct grid *g = self;
    return nav_histogram_components(&g->histogram, &g->pending, 1.0, out, room);
}

static struct nav_resolution grid_resolution(const void *self)
{
    const struct grid *g = self;
    const struct nav_shape *s = &g->histogram.shape;
    return (struct nav_resolution){s->cell, s->cell_theta, fmin(s->cell, g->wanted.edge), 0.0};
}

const struct nav_filter_ops nav_grid_filter = {.name = "grid",
                                               .create = grid_create,
                                               .destroy = grid_destroy,
                                               .predict = grid_predict,
                                               .update = grid_update,
                                               .estimate = grid_estimate,
                                               .components = grid_components,
                                               .resolution = grid_resolution};
