/* The exact filter: equation 4 on a grid over the whole arena.
 *
 * A cell's likelihood is the mean over its sub-poses, so that a border that cuts a cell counts by its share. Where the
 * robot cannot stand the likelihood is 0. Motion is put off until something is read: one pass then does for several
 * rows, and nothing is lost, since motions compose exactly. */
#include <math.h>
#include <stdlib.h>

#include "calibration.h"
#include "expected.h"
#include "filter.h"
#include "gaussian.h"
#include "lattice.h"
#include "likelihood.h"
#include "mixture.h"

static const double SURE = 0.5;   /* confidence from which a belief judges whiskers, */
static const double LIGHT = 1e-4; /* by cells with more mass than this */

struct grid {
    const struct nav_problem *problem;
    struct nav_likelihood *likelihood;
    struct nav_expected *expected;
    struct nav_mixture *mixture;
    struct nav_lattice lattice;
    struct nav_layer *layer;     /* [slices] where each lies in the tables */
    struct nav_pending pending;  /* since the last update */
    struct nav_gaussian summary; /* of the belief at the last update: mean near the mode, covariance about it */
    double confidence;
    struct nav_calibration calibration;
    struct nav_motion last; /* motion of the row before, as applied */
};

static void destroy(void *self)
{
    struct grid *g = self;
    nav_likelihood_free(g->likelihood);
    nav_expected_free(g->expected);
    nav_mixture_free(g->mixture);
    nav_lattice_free(&g->lattice);
    free(g->layer);
    free(g);
}

/* Where a slice's sub-poses lie among those of the table, to the nearest. */
static struct nav_layer layer(const struct grid *g, int p)
{
    const struct nav_lattice *l = &g->lattice;
    const struct nav_expected *e = g->expected;
    double turns = (p + 0.5 / g->mixture->turns) / l->nh + l->rotation / (2.0 * NAV_PI);
    return (struct nav_layer){
        .heading = (int)((turns - floor(turns)) * e->nh) % e->nh,
        .x = (int)floor(l->shift_x[p] / e->step + 0.5),
        .y = (int)floor(l->shift_y[p] / e->step + 0.5),
    };
}

static void find_layers(struct grid *g)
{
    for (int p = 0; p < g->lattice.nh; p++)
        g->layer[p] = layer(g, p);
}

static void likelihood_row(const void *self, int p, int j, int begin, int end, float *out)
{
    const struct grid *g = self;
    nav_mixture_look_up(g->mixture, &g->layer[p], j, begin, end, out);
}

/* Adds what one cell expects, where it will be after its slice's pending whole-cell move. */
static void expect_cell(struct grid *g, int p, int i, int j, double mass)
{
    const struct nav_expected *e = g->expected;
    const struct nav_mix *mix = nav_mixture_at(g->mixture, &g->layer[p], i, j);
    for (uint32_t n = mix->first; n < mix->end; n++) {
        const struct nav_part *part = &g->mixture->part[n];
        const uint8_t *codes = e->codes + ((size_t)part->signature + 1) * ((size_t)e->whiskers + 1);
        nav_trust_add(g->likelihood, codes, mass * (double)part->share);
    }
}

/* The same for a slice's cells near the pose expected, light ones left out. */
static void expect_slice(struct grid *g, int p)
{
    const struct nav_lattice *l = &g->lattice;
    struct nav_pose at = g->summary.mean;
    int reach = (int)ceil(NAV_NEAR_M / l->cell);
    int x = (int)floor((at.x - l->shift_x[p]) / l->cell), y = (int)floor((at.y - l->shift_y[p]) / l->cell);
    for (int j = y - reach; j <= y + reach; j++) {
        int row = j - l->roll_y[p];
        if (j < 0 || j >= l->ny || row < 0 || row >= l->ny)
            continue;
        for (int i = x - reach; i <= x + reach; i++) {
            int column = i - l->roll_x[p];
            if (i < 0 || i >= l->nx || column < 0 || column >= l->nx)
                continue;
            double mass = l->scale * (double)nav_lattice_slice(l, p)[row * l->nx + column];
            if (mass > LIGHT)
                expect_cell(g, p, i, j, mass);
        }
    }
}

/* Judges the row's readings by a belief that is fairly sure. */
static void learn_trust(struct grid *g)
{
    const struct nav_lattice *l = &g->lattice;
    if (g->confidence < SURE)
        return;
    nav_trust_begin(g->likelihood);
    for (int p = 0; p < l->nh; p++) {
        if (fabs(nav_wrap(nav_lattice_heading(l, p) - g->summary.mean.theta)) <= NAV_NEAR_RAD)
            expect_slice(g, p);
    }
    nav_trust_learn(g->likelihood);
}

/* Multiplies by the likelihood and normalises; `extra` is added to each cell first. Returns false with no mass. */
static bool reweigh(struct grid *g, double extra)
{
    struct nav_lattice *l = &g->lattice;
    const struct nav_lattice_weigh weigh = {
        .row = likelihood_row, .self = g, .begin = g->mixture->begin, .end = g->mixture->end, .extra = extra};
    nav_mixture_begin(g->mixture, g->expected);
    for (int p = 0; p < l->nh; p++)
        nav_mixture_work_out(g->mixture, &g->layer[p]);
    nav_lattice_pass(l, &weigh, g->summary.mean);
    if (!(l->total > 0.0 && isfinite(l->total)))
        return false;
    l->scale = 1.0 / l->total;
    return true;
}

static void summarise(struct grid *g)
{
    struct nav_lattice *l = &g->lattice;
    if (!(l->total > 0.0)) { /* no place in the arena is free: nothing can be known */
        struct nav_problem anywhere = *g->problem;
        anywhere.prior.uniform = true;
        g->summary = nav_gaussian_prior(&anywhere);
        g->confidence = 0.0;
        return;
    }
    const struct nav_slices slices = nav_lattice_slices(l);
    struct nav_pose mode = nav_slices_centre(&slices, nav_lattice_peak(l, l->peak_slice));
    g->confidence = fmin(nav_slices_summarise(&slices, mode, &g->summary) * l->scale, 1.0);
}

/* Takes a prior, clipped to free space; false when that leaves nothing. */
static bool start(struct grid *g, const struct nav_prior *prior)
{
    nav_lattice_fill(&g->lattice, prior);
    nav_lattice_clip(&g->lattice, g->mixture->begin, g->mixture->end);
    return reweigh(g, 0.0);
}

/* Spreads the belief over free space, by what the present row says. */
static void forget(struct grid *g)
{
    start(g, &(struct nav_prior){.uniform = true});
}

/* The belief before anything is read: the tables say that all is equally likely. */
static void begin(struct grid *g)
{
    g->summary.mean = g->problem->prior.mean;
    find_layers(g);
    nav_expected_evaluate(g->expected, g->likelihood);
    if (!start(g, &g->problem->prior))
        forget(g);
    summarise(g);
}

static bool make_tables(struct grid *g)
{
    const struct nav_problem *problem = g->problem;
    const struct nav_settings *s = &problem->settings;
    int sub = (int)s->grid_sub, turns = (int)s->grid_sub_heading;
    double step = s->grid_cell_m / sub, turn = g->lattice.cell_theta / turns;
    /* A look-up stands for poses within half a step and half a turn: that spreads the distances it should give. */
    double blur = hypot(step, 0.2 * turn) / sqrt(12.0);
    g->likelihood = nav_likelihood_new(&problem->arena, &problem->robot, s, blur);
    if (g->likelihood)
        g->expected = nav_expected_new(g->likelihood, step, g->lattice.nh * turns, 3 * sub);
    if (g->expected)
        g->mixture = nav_mixture_new(g->expected, g->lattice.nx, g->lattice.ny, sub, turns);
    if (!g->mixture)
        return false;
    nav_expected_forget_poses(g->expected);
    return true;
}

static void *create(const struct nav_problem *problem)
{
    const struct nav_settings *s = &problem->settings;
    struct grid *g = calloc(1, sizeof *g);
    if (!g)
        return NULL;
    g->problem = problem;
    nav_calibration_init(&g->calibration);
    int headings = (int)fmax(round(360.0 / s->grid_cell_deg), 1.0);
    g->layer = calloc((size_t)headings, sizeof *g->layer);
    if (!g->layer ||
        nav_lattice_init(&g->lattice, problem->arena.size_x, problem->arena.size_y, s->grid_cell_m, headings) ||
        !make_tables(g)) {
        destroy(g);
        return NULL;
    }
    begin(g);
    return g;
}

static void estimate(const void *self, struct nav_estimate *out);

/* The motion as the odometry's learned errors correct it. What is learned comes from the rows before. */
static struct nav_motion calibrated(struct grid *g, const struct nav_motion *motion)
{
    if (g->problem->settings.motion_calibrate < 0.5)
        return *motion;
    struct nav_estimate now;
    estimate(g, &now);
    nav_calibration_learn(&g->calibration, &g->last, &now);
    g->last = nav_calibration_apply(&g->calibration, motion);
    return g->last;
}

static void predict(void *self, const struct nav_motion *told)
{
    struct grid *g = self;
    struct nav_motion motion = calibrated(g, told);
    struct nav_noise noise = nav_motion_noise(&g->problem->robot, &g->problem->settings, &motion);
    noise.position += nav_slice_fan(motion.step, g->lattice.cell_theta, g->problem->settings.motion_along_m);
    nav_pending_add(&g->pending, motion.step, noise);
}

static void update(void *self, const struct nav_evidence *evidence)
{
    struct grid *g = self;
    nav_lattice_shift(&g->lattice, g->pending.step, &g->pending.noise);
    g->summary.mean = nav_compose(g->summary.mean, g->pending.step);
    g->pending = (struct nav_pending){.step = {0.0, 0.0, 0.0}};
    find_layers(g);
    nav_likelihood_read(g->likelihood, evidence);
    learn_trust(g);
    nav_expected_evaluate(g->expected, g->likelihood);
    if (!reweigh(g, g->problem->settings.grid_teleport / (double)nav_lattice_cells(&g->lattice)))
        forget(g);
    summarise(g);
}

static void estimate(const void *self, struct nav_estimate *out)
{
    const struct grid *g = self;
    nav_gaussian_ahead(&g->summary, &g->pending, out);
    out->confidence = g->confidence;
    out->evaluations = (long)nav_lattice_cells(&g->lattice);
    out->states = out->touched = out->evaluations;
    out->distinct = (long)g->expected->signatures - 1;
    out->bytes = sizeof *g + 2 * nav_lattice_cells(&g->lattice) * sizeof(float) + nav_expected_bytes(g->expected) +
                 nav_mixture_bytes(g->mixture);
}

static long components(const void *self, struct nav_component *out, long room)
{
    const struct grid *g = self;
    const struct nav_lattice *l = &g->lattice;
    const struct nav_slices slices = nav_lattice_slices(l);
    double sigma = sqrt(l->cell * l->cell / 12.0 + l->owed_position + g->pending.noise.position);
    double sigma_turn = sqrt(l->cell_theta * l->cell_theta / 12.0 + l->owed_heading + g->pending.noise.heading);
    long count = 0;
    for (size_t n = 0; n < nav_lattice_cells(l); n++) {
        if (!(l->mass[n] > 0.0f))
            continue;
        if (count < room)
            out[count] = (struct nav_component){nav_compose(nav_slices_centre(&slices, n), g->pending.step), sigma,
                                                sigma_turn, (double)l->mass[n] * l->scale};
        count++;
    }
    return count;
}

static struct nav_resolution resolution(const void *self)
{
    const struct grid *g = self;
    double finest = nav_sensors_detail(&g->likelihood->sensors).detail;
    return (struct nav_resolution){g->lattice.cell, g->lattice.cell_theta, fmin(g->lattice.cell, finest / 2.0)};
}

const struct nav_filter_ops nav_grid_filter = {.name = "grid",
                                               .create = create,
                                               .destroy = destroy,
                                               .predict = predict,
                                               .update = update,
                                               .estimate = estimate,
                                               .components = components,
                                               .resolution = resolution};
