/* The exact filter: equation 4 on a grid over the whole arena.
 *
 * A cell's likelihood is the mean over its sub-poses, so that a border that cuts a cell counts by its share. Where the
 * robot cannot stand the likelihood is 0. Motion is put off until something is read: one pass then does for several
 * rows, and nothing is lost, since motions compose exactly. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "expected.h"
#include "filter.h"
#include "gaussian.h"
#include "lattice.h"
#include "likelihood.h"

struct grid {
    const struct nav_problem *problem;
    struct nav_likelihood *likelihood;
    struct nav_expected *expected;
    struct nav_lattice lattice;
    int sub, sub_heading;           /* sub-poses per cell edge and per slice */
    float *row;                     /* [nx] sum of the sub-poses' likelihoods */
    struct nav_pose pending;        /* motion since the last update ... */
    struct nav_noise pending_noise; /* ... and its noise */
    struct nav_gaussian summary;    /* of the belief at the last update: mean near the mode, covariance about it */
    double confidence;
};

static void destroy(void *self)
{
    struct grid *g = self;
    nav_likelihood_free(g->likelihood);
    nav_expected_free(g->expected);
    nav_lattice_free(&g->lattice);
    free(g->row);
    free(g);
}

/* Sum over the sub-poses of every cell of one lattice row: likelihood[nx] += value of each sub-pose in heading k. */
static void add_row(const struct grid *g, const uint32_t *signature, float *sum)
{
    const float *value = g->expected->value;
    for (int i = 0; i < g->lattice.nx; i++) {
        for (int a = 0; a < g->sub; a++)
            sum[i] += value[*signature++];
    }
}

/* Nearest lattice steps of a shift: the table's poses are sub-poses of an unshifted cell. */
static int steps(const struct grid *g, double shift)
{
    return (int)floor(shift / g->expected->step + 0.5);
}

static int heading_index(const struct grid *g, int slice, int part)
{
    double heading = (slice + (part + 0.5) / g->sub_heading) * g->lattice.cell_theta + g->lattice.rotation;
    double turns = heading / (2.0 * NAV_PI);
    return (int)((turns - floor(turns)) * g->expected->nh) % g->expected->nh;
}

static double reweigh_slice(struct grid *g, int p, float spare)
{
    struct nav_lattice *l = &g->lattice;
    int dx = steps(g, l->shift_x[p]), dy = steps(g, l->shift_y[p]);
    float *mass = nav_lattice_slice(l, p);
    double total = 0.0;
    for (int j = 0; j < l->ny; j++, mass += l->nx) {
        memset(g->row, 0, (size_t)l->nx * sizeof *g->row);
        for (int part = 0; part < g->sub_heading; part++) {
            int k = heading_index(g, p, part);
            for (int b = 0; b < g->sub; b++)
                add_row(g, nav_expected_row(g->expected, k, j * g->sub + b + dy) + dx, g->row);
        }
        for (int i = 0; i < l->nx; i++) {
            mass[i] = (mass[i] + spare) * g->row[i];
            total += (double)mass[i];
        }
    }
    return total;
}

/* Multiplies by the table's values and normalises; `spare` is added to each cell first. Returns false with no mass. */
static bool reweigh(struct grid *g, double spare)
{
    double total = 0.0;
    for (int p = 0; p < g->lattice.nh; p++)
        total += reweigh_slice(g, p, (float)spare);
    if (!(total > 0.0 && isfinite(total)))
        return false;
    nav_lattice_scale(&g->lattice, 1.0 / total);
    return true;
}

static void summarise(struct grid *g)
{
    struct nav_pose mode = nav_lattice_mode(&g->lattice);
    g->summary.mean = mode;
    nav_lattice_near(&g->lattice, mode, &g->summary.mean);
    g->confidence = fmin(nav_lattice_near(&g->lattice, g->summary.mean, NULL), 1.0);
    nav_lattice_covariance(&g->lattice, g->summary.mean, g->summary.covariance);
}

/* Spreads the belief over free space. */
static void forget(struct grid *g)
{
    nav_lattice_fill(&g->lattice, &(struct nav_prior){.uniform = true});
    reweigh(g, 0.0);
}

static void begin(struct grid *g)
{
    for (uint32_t n = 1; n < g->expected->signatures; n++)
        g->expected->value[n] = 1.0f;
    nav_lattice_fill(&g->lattice, &g->problem->prior);
    if (!reweigh(g, 0.0))
        forget(g);
    summarise(g);
}

static void *create(const struct nav_problem *problem)
{
    const struct nav_settings *s = &problem->settings;
    struct grid *g = calloc(1, sizeof *g);
    if (!g)
        return NULL;
    g->problem = problem;
    g->sub = (int)s->grid_sub;
    g->sub_heading = (int)s->grid_sub_heading;
    int headings = (int)fmax(round(360.0 / s->grid_cell_deg), 1.0);
    double step = s->grid_cell_m / g->sub, turn = 2.0 * NAV_PI / headings / g->sub_heading;
    /* A look-up stands for poses within half a step and half a turn: that spreads the distances it should give. */
    double blur = hypot(step, 0.2 * turn) / sqrt(12.0);
    if (nav_lattice_init(&g->lattice, problem->arena.size_x, problem->arena.size_y, s->grid_cell_m, headings)) {
        destroy(g);
        return NULL;
    }
    g->row = calloc((size_t)g->lattice.nx, sizeof *g->row);
    g->likelihood = nav_likelihood_new(&problem->arena, &problem->robot, s, blur);
    if (g->row && g->likelihood)
        g->expected = nav_expected_new(&problem->arena, &problem->robot, g->likelihood, step, headings * g->sub_heading,
                                       2 * g->sub);
    if (!g->expected) {
        destroy(g);
        return NULL;
    }
    begin(g);
    return g;
}

static void predict(void *self, const struct nav_motion *motion)
{
    struct grid *g = self;
    struct nav_noise noise = nav_motion_noise(&g->problem->robot, &g->problem->settings, motion);
    /* Headings differ within a slice (uniform: width^2 / 12), and a drive spreads what one cell holds. */
    double width = g->lattice.cell_theta, distance = hypot(motion->step.x, motion->step.y);
    noise.position += width * width / 12.0 * distance * fmax(distance, g->problem->settings.motion_along_m);
    g->pending = nav_compose(g->pending, motion->step);
    g->pending_noise.position += noise.position;
    g->pending_noise.heading += noise.heading;
}

static void update(void *self, const struct nav_evidence *evidence)
{
    struct grid *g = self;
    nav_lattice_move(&g->lattice, g->pending, &g->pending_noise);
    g->pending = (struct nav_pose){0.0, 0.0, 0.0};
    g->pending_noise = (struct nav_noise){0.0, 0.0};
    nav_likelihood_read(g->likelihood, evidence);
    nav_expected_evaluate(g->expected, g->likelihood);
    if (!reweigh(g, g->problem->settings.grid_teleport / (double)nav_lattice_cells(&g->lattice)))
        forget(g);
    summarise(g);
}

static void estimate(const void *self, struct nav_estimate *out)
{
    const struct grid *g = self;
    struct nav_gaussian now = g->summary;
    nav_gaussian_move(&now, g->pending, &g->pending_noise);
    out->pose = now.mean;
    memcpy(out->covariance, now.covariance, sizeof now.covariance);
    out->confidence = g->confidence;
    out->evaluations = (long)nav_lattice_cells(&g->lattice);
    out->states = out->touched = out->evaluations;
    out->distinct = (long)g->expected->signatures - 1;
    out->bytes = sizeof *g + 2 * nav_lattice_cells(&g->lattice) * sizeof(float) + nav_expected_bytes(g->expected);
}

static long components(const void *self, struct nav_component *out, long room)
{
    const struct grid *g = self;
    const struct nav_lattice *l = &g->lattice;
    double sigma = sqrt(l->cell * l->cell / 12.0 + l->owed_position + g->pending_noise.position);
    double sigma_turn = sqrt(l->cell_theta * l->cell_theta / 12.0 + l->owed_heading + g->pending_noise.heading);
    long count = 0;
    for (size_t n = 0; n < nav_lattice_cells(l); n++) {
        if (!(l->mass[n] > 0.0f))
            continue;
        if (count < room)
            out[count] = (struct nav_component){nav_compose(nav_lattice_centre(l, n), g->pending), sigma, sigma_turn,
                                                (double)l->mass[n]};
        count++;
    }
    return count;
}

const struct nav_filter_ops nav_grid_filter = {.name = "grid",
                                               .create = create,
                                               .destroy = destroy,
                                               .predict = predict,
                                               .update = update,
                                               .estimate = estimate,
                                               .components = components};
