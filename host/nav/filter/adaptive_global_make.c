/* The arena-wide belief's memory and tables, made once, and the belief as it begins. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "adaptive_global_parts.h"

size_t adaptive_global_cells(const struct adaptive_global *g)
{
    return (size_t)g->nh * (size_t)g->ny * (size_t)g->nx;
}

size_t adaptive_global_stored(const struct adaptive_global *g)
{
    return (size_t)g->nh * (size_t)g->ny * (size_t)g->pitch;
}

/* A heading's cell may move the farthest sensor by this share of a cell's edge. */
static const double TURN_SHARE = 2.0 / 3.0;
static const double DEGREES_LEAST = 2.0;

/* However fine the detail: what its tables take in memory and set-up. */
static const double CELLS_MOST = 1e6;

/* Headings for cells of this edge; `lever`: of the farthest sensor that tells the detail. */
static void choose_headings(struct adaptive_global *g, double cell, double lever)
{
    const struct nav_settings *s = &g->problem->settings;
    double degrees = s->adaptive_cell_deg;
    if (cell < s->adaptive_cell_m)
        degrees = fmin(degrees, TURN_SHARE * cell / fmax(lever, NAV_NEAR_M / 10.0) * 180.0 / NAV_PI);
    g->nh = (int)fmax(round(360.0 / fmax(degrees, DEGREES_LEAST)), 1.0);
    g->nh += g->nh % 4 ? 4 - g->nh % 4 : 0; /* quarter turns map slices to slices */
    g->cell_theta = 2.0 * NAV_PI / g->nh;
}

/* Smallest cells, but no smaller than wanted, for which a slice fits a quarter of the budget and the arena a few rows'
 * budgets. */
static double smallest_cell(const struct adaptive_global *g)
{
    const struct nav_arena *arena = &g->problem->arena;
    double most = fmin(g->budget / (4.0 * (2.0 + ADAPTIVE_PASSES_MOST)),
                       fmin(g->problem->settings.adaptive_rows * g->budget, CELLS_MOST) / g->nh);
    return fmax(g->wanted, sqrt(arena->size_x * arena->size_y / most));
}

/* Cells half as wide as the finest detail that a sensor tells, where that is less than the setting's; wider ones, and
 * fewer headings for them, where the budget asks for it. */
static int choose_cells(struct adaptive_global *g)
{
    enum { ROUNDS = 8 };
    const struct nav_problem *problem = g->problem;
    const struct nav_settings *s = &problem->settings;
    struct nav_sensors sensors;
    int failed = nav_sensors_init(&sensors, &problem->arena, &problem->robot, s, 0.0);
    struct nav_detail finest = nav_sensors_detail(&sensors);
    nav_sensors_free(&sensors);
    g->wanted = fmin(s->adaptive_cell_m, finest.detail / 2.0);
    g->budget =
        g->wanted < s->adaptive_cell_m ? fmax(s->adaptive_budget, s->adaptive_detail_budget) : s->adaptive_budget;
    g->cell = g->wanted;
    for (int n = 0; n < ROUNDS; n++) {
        choose_headings(g, g->cell, finest.lever);
        g->cell = smallest_cell(g);
    }
    g->nx = (int)ceil(problem->arena.size_x / g->cell - 1e-6);
    g->ny = (int)ceil(problem->arena.size_y / g->cell - 1e-6);
    g->pitch = (g->nx + NAV_LANES - 1) / NAV_LANES * NAV_LANES;
    return failed;
}

/* Rows of signatures, phase by phase, so that neighbouring cells of a slice have theirs side by side. */
static size_t signature_rows(const struct adaptive_global *g)
{
    return (size_t)g->expected->nh * ADAPTIVE_SUB * ADAPTIVE_SUB * ((size_t)g->ny + 1);
}

static void sort_signatures(struct adaptive_global *g)
{
    const struct nav_expected *e = g->expected;
    uint32_t *out = g->signature;
    for (size_t n = 0; n < signature_rows(g); n++, out += adaptive_signature_pitch(g)) {
        int j = (int)(n % ((size_t)g->ny + 1)), phase = (int)(n / ((size_t)g->ny + 1));
        int px = phase % ADAPTIVE_SUB, py = phase / ADAPTIVE_SUB % ADAPTIVE_SUB;
        const uint32_t *row = nav_expected_row(e, phase / ADAPTIVE_SUB / ADAPTIVE_SUB, j * ADAPTIVE_SUB + py);
        for (int i = 0; i <= g->nx; i++) /* the cell beyond the last lies in the lattice's margin */
            out[i] = row[i * ADAPTIVE_SUB + px];
    }
}

static int make_tables(struct adaptive_global *g)
{
    const struct nav_problem *problem = g->problem;
    /* A look-up stands for a cell: that spreads the distances it should give. */
    double blur = hypot(g->cell, 0.2 * g->cell_theta) / sqrt(12.0);
    g->likelihood = nav_likelihood_new(&problem->arena, &problem->robot, &problem->settings, blur);
    if (!g->likelihood)
        return -1;
    g->expected = nav_expected_new(g->likelihood, g->cell / ADAPTIVE_SUB, g->nh * ADAPTIVE_SUB, 2 * ADAPTIVE_SUB);
    g->factor = calloc((size_t)g->likelihood->whiskers + 1, sizeof *g->factor);
    if (!g->expected || !g->factor)
        return -1;
    for (int w = 0; w < g->likelihood->whiskers; w++) {
        g->factor[w] = calloc((size_t)g->likelihood->model[w].codes, sizeof **g->factor);
        if (!g->factor[w])
            return -1;
    }
    g->value = calloc(g->expected->signatures, sizeof *g->value);
    g->known = calloc(g->expected->signatures, sizeof *g->known);
    g->signature = calloc(signature_rows(g) * adaptive_signature_pitch(g), sizeof *g->signature);
    if (!g->value || !g->known || !g->signature)
        return -1;
    for (uint32_t n = 1; n < g->expected->signatures; n++)
        g->value[n] = -1.0f;
    sort_signatures(g);
    return 0;
}

static double free_share(const struct adaptive_global *g)
{
    double standing = 0.0, all = (double)g->nh * ADAPTIVE_SUB * g->ny * ADAPTIVE_SUB * g->nx * ADAPTIVE_SUB;
    for (int k = 0; k < g->nh * ADAPTIVE_SUB; k++) {
        for (int j = 0; j < g->ny * ADAPTIVE_SUB; j++) {
            const uint32_t *row = nav_expected_row(g->expected, k, j);
            for (int i = 0; i < g->nx * ADAPTIVE_SUB; i++)
                standing += row[i] != 0;
        }
    }
    return fmax(standing, 1.0) / all;
}

/* What a slice needs while it moves. */
static int make_lines(struct adaptive_global *g)
{
    size_t lines = (size_t)g->nh * (size_t)g->ny, plane = (size_t)(g->ny + 2) * (size_t)(g->pitch + 2 * NAV_LANES);
    g->span = calloc(lines, sizeof *g->span);
    g->span_turned = calloc(lines, sizeof *g->span_turned);
    g->moved = calloc((size_t)g->ny, sizeof *g->moved);
    g->region = calloc((size_t)g->ny, sizeof *g->region);
    g->coordinate = calloc((size_t)g->pitch, sizeof *g->coordinate);
    g->like = calloc((size_t)(g->ny * g->pitch), sizeof *g->like);
    g->missing = calloc((size_t)g->pitch, sizeof *g->missing);
    for (int n = 0; n < 2; n++)
        g->plane[n] = calloc(plane, sizeof **g->plane);
    int spans = g->span && g->span_turned && g->moved && g->region;
    return spans && g->coordinate && g->like && g->missing && g->plane[0] && g->plane[1] ? 0 : -1;
}

void adaptive_global_restart(struct adaptive_global *g, uint64_t row)
{
    g->fresh = true;
    g->next = row;
    g->job.running = false;
    g->rotation = g->owed_position = g->owed_heading = g->gained = 0.0;
    memset(g->shift_x, 0, (size_t)g->nh * sizeof *g->shift_x);
    memset(g->shift_y, 0, (size_t)g->nh * sizeof *g->shift_y);
    g->total = g->scattered = 1.0;
    const struct nav_arena *arena = &g->problem->arena;
    struct nav_problem lost = *g->problem;
    lost.prior.uniform = true;
    g->summary = (struct nav_summary){.belief = nav_gaussian_prior(&lost)};
    g->summary.near = NAV_PI * NAV_NEAR_M * NAV_NEAR_M / (arena->size_x * arena->size_y) * NAV_NEAR_RAD / NAV_PI;
}

void adaptive_global_clear(struct adaptive_global *g, uint64_t row)
{
    adaptive_global_restart(g, row);
    g->fresh = false;
    memset(g->mass, 0, adaptive_global_stored(g) * sizeof *g->mass);
    memset(g->span, 0, (size_t)g->nh * (size_t)g->ny * sizeof *g->span);
}

/* Most hypotheses: adaptive.most, and a tenth of the budget, since each may be touched up to five times per row. */
static double adaptive_global_room(const struct nav_settings *s)
{
    return floor(fmax(fmin(s->adaptive_most, s->adaptive_budget / 10.0), 16.0));
}

int adaptive_global_init(struct adaptive_global *g, const struct nav_problem *problem)
{
    *g = (struct adaptive_global){.problem = problem, .room = adaptive_global_room(&problem->settings)};
    if (choose_cells(g))
        return -1;
    g->shift_x = calloc((size_t)g->nh, sizeof *g->shift_x);
    g->shift_y = calloc((size_t)g->nh, sizeof *g->shift_y);
    g->mass = calloc(adaptive_global_stored(g), sizeof *g->mass);
    g->turned = calloc(adaptive_global_stored(g), sizeof *g->turned);
    g->moment = calloc((size_t)g->nh, sizeof *g->moment);
    if (!g->moment || !g->shift_x || !g->shift_y || !g->mass || !g->turned || make_lines(g) || make_tables(g))
        return -1;
    g->log_free = log(free_share(g));
    nav_expected_forget_poses(g->expected);
    adaptive_global_restart(g, 0);
    return 0;
}

void adaptive_global_free(struct adaptive_global *g)
{
    for (int w = 0; g->factor && w < g->likelihood->whiskers; w++)
        free(g->factor[w]);
    free(g->factor);
    nav_likelihood_free(g->likelihood);
    nav_expected_free(g->expected);
    free(g->value);
    free(g->shift_x);
    free(g->shift_y);
    free(g->mass);
    free(g->turned);
    free(g->moment);
    free(g->span);
    free(g->span_turned);
    free(g->moved);
    free(g->region);
    free(g->coordinate);
    free(g->like);
    free(g->missing);
    free(g->plane[0]);
    free(g->plane[1]);
    free(g->signature);
    free(g->known);
}

size_t adaptive_global_bytes(const struct adaptive_global *g)
{
    return 2 * adaptive_global_stored(g) * sizeof(float) + nav_expected_bytes(g->expected) +
           signature_rows(g) * adaptive_signature_pitch(g) * sizeof *g->signature +
           g->expected->signatures * (sizeof *g->value + sizeof *g->known);
}
