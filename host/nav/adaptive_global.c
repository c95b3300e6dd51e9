#include "adaptive_global.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SUB = 2, SUB_HEADING = 2 }; /* table poses per cell edge and per slice */

/* Variance is saved up to this share of a squared cell edge, and paid in passes of at most so much (lattice.c). */
static const double OWED_LEAST = 0.04, PASS_MOST = 0.5;
enum { PASSES_MOST = 4 };
/* A cell with less than this share of all mass is dropped. A uniform belief has 1e-5 in each of its cells. */
static const float SHARE_LEAST = 1e-10f;

size_t adaptive_global_cells(const struct adaptive_global *g)
{
    return (size_t)g->nh * (size_t)g->ny * (size_t)g->nx;
}

static size_t slice_cells(const struct adaptive_global *g)
{
    return (size_t)g->ny * (size_t)g->nx;
}

/* Smallest cells for which a slice fits a quarter of the budget and the arena a few rows' budgets. */
static void choose_cells(struct adaptive_global *g)
{
    const struct nav_settings *s = &g->problem->settings;
    const struct nav_arena *arena = &g->problem->arena;
    double most = fmin(s->adaptive_budget / (4.0 * (3.0 + PASSES_MOST)),
                       s->adaptive_rows * s->adaptive_budget / fmax(round(360.0 / s->adaptive_cell_deg), 1.0));
    g->nh = (int)fmax(round(360.0 / s->adaptive_cell_deg), 1.0);
    g->nh += g->nh % 4 ? 4 - g->nh % 4 : 0; /* quarter turns map slices to slices */
    g->cell_theta = 2.0 * NAV_PI / g->nh;
    g->cell = fmax(s->adaptive_cell_m, sqrt(arena->size_x * arena->size_y / most));
    g->nx = (int)ceil(arena->size_x / g->cell - 1e-6);
    g->ny = (int)ceil(arena->size_y / g->cell - 1e-6);
}

static int make_tables(struct adaptive_global *g)
{
    const struct nav_problem *problem = g->problem;
    /* A look-up stands for a cell: that spreads the distances it should give. */
    double blur = hypot(g->cell, 0.2 * g->cell_theta) / sqrt(12.0);
    g->likelihood = nav_likelihood_new(&problem->arena, &problem->robot, &problem->settings, blur);
    if (!g->likelihood)
        return -1;
    g->expected =
        nav_expected_new(&problem->arena, &problem->robot, g->likelihood, g->cell / SUB, g->nh * SUB_HEADING, 2 * SUB);
    g->factor = calloc((size_t)g->likelihood->whiskers + 1, sizeof *g->factor);
    if (!g->expected || !g->factor)
        return -1;
    for (int w = 0; w < g->likelihood->whiskers; w++) {
        g->factor[w] = calloc((size_t)g->likelihood->model[w].codes, sizeof **g->factor);
        if (!g->factor[w])
            return -1;
    }
    g->value = calloc(g->expected->signatures, sizeof *g->value);
    return g->value ? 0 : -1;
}

static double free_share(const struct adaptive_global *g)
{
    double standing = 0.0, all = (double)g->nh * SUB_HEADING * g->ny * SUB * g->nx * SUB;
    for (int k = 0; k < g->nh * SUB_HEADING; k++) {
        for (int j = 0; j < g->ny * SUB; j++) {
            const uint32_t *row = nav_expected_row(g->expected, k, j);
            for (int i = 0; i < g->nx * SUB; i++)
                standing += row[i] != 0;
        }
    }
    return fmax(standing, 1.0) / all;
}

int adaptive_global_init(struct adaptive_global *g, const struct nav_problem *problem)
{
    *g = (struct adaptive_global){.problem = problem, .room = problem->settings.adaptive_most};
    choose_cells(g);
    g->shift_x = calloc((size_t)g->nh, sizeof *g->shift_x);
    g->shift_y = calloc((size_t)g->nh, sizeof *g->shift_y);
    g->mass = calloc(adaptive_global_cells(g), sizeof *g->mass);
    g->scratch = calloc(adaptive_global_cells(g), sizeof *g->scratch);
    g->live = calloc((size_t)g->nh * (size_t)g->ny, 1);
    g->moment = calloc((size_t)g->nh * 6, sizeof *g->moment);
    if (!g->moment || !g->shift_x || !g->shift_y || !g->mass || !g->scratch || !g->live || make_tables(g))
        return -1;
    g->log_free = log(free_share(g));
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
    free(g->scratch);
    free(g->live);
    free(g->moment);
}

size_t adaptive_global_bytes(const struct adaptive_global *g)
{
    return 2 * adaptive_global_cells(g) * sizeof(float) + nav_expected_bytes(g->expected) +
           g->expected->signatures * sizeof *g->value;
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
    g->peak = 0.0;
    const struct nav_arena *arena = &g->problem->arena;
    struct nav_problem lost = *g->problem;
    lost.prior.uniform = true;
    g->summary = (struct adaptive_summary){.belief = nav_gaussian_prior(&lost)};
    g->summary.near = NAV_PI * NAV_NEAR_M * NAV_NEAR_M / (arena->size_x * arena->size_y) * NAV_NEAR_RAD / NAV_PI;
}

bool adaptive_global_current(const struct adaptive_global *g, const struct adaptive_log *log)
{
    return g->next == log->head && !g->job.running;
}

/* Adds one row's tables to the factors, as logarithms. */
static void read_row(struct adaptive_global *g, struct adaptive_log *log, uint64_t row)
{
    struct nav_evidence evidence = adaptive_log_replay(log, row);
    nav_likelihood_read(g->likelihood, &evidence);
    for (int w = 0; w < g->likelihood->whiskers; w++) {
        for (int k = 0; k < g->likelihood->model[w].codes; k++)
            g->factor[w][k] += g->likelihood->table[w][k];
    }
}

/* Adds one row's motion, and the noise that it and the width of slices bring. */
static void move_row(struct adaptive_global *g, const struct adaptive_entry *entry)
{
    double along = g->problem->settings.motion_along_m, width = g->cell_theta;
    double distance = hypot(entry->step.x, entry->step.y);
    g->job.step = nav_compose(g->job.step, entry->step);
    g->owed_position += entry->noise.position + width * width / 12.0 * distance * fmax(distance, along);
    g->owed_heading += entry->noise.heading;
    g->job.local += entry->local;
}

/* How far the whiskers have gone in the job so far, m. */
static double path(const struct adaptive_job *job)
{
    return hypot(job->step.x, job->step.y) + 0.2 * fabs(job->step.theta);
}

/* Gathers rows: those that the log has overwritten only move; a contact is too sharp to be read at another's place. */
static void gather(struct adaptive_global *g, struct adaptive_log *log)
{
    uint64_t row = g->next;
    move_row(g, adaptive_log_entry(log, row));
    read_row(g, log, row);
    bool contact = adaptive_log_entry(log, row)->contact;
    struct nav_pose first = g->job.step;
    for (row++; row < log->head && !contact; row++) {
        const struct adaptive_entry *entry = adaptive_log_entry(log, row);
        struct adaptive_job ahead = {.step = {g->job.step.x - first.x + entry->step.x,
                                              g->job.step.y - first.y + entry->step.y,
                                              g->job.step.theta - first.theta + entry->step.theta}};
        if (entry->contact || path(&ahead) > g->cell)
            break;
        move_row(g, entry);
        read_row(g, log, row);
    }
    g->job.end = row;
}

/* Logarithms to factors relative to the best. */
static double exponentiate(struct adaptive_global *g)
{
    double reference = 0.0;
    for (int w = 0; w < g->likelihood->whiskers; w++) {
        float best = g->factor[w][0];
        int codes = g->likelihood->model[w].codes;
        for (int k = 1; k < codes; k++)
            best = fmaxf(best, g->factor[w][k]);
        for (int k = 0; k < codes; k++)
            g->factor[w][k] = expf(g->factor[w][k] - best);
        reference += (double)best;
    }
    return reference;
}

static float side_of(double *owed, double cell, int passes_most, int *passes)
{
    double share = *owed / (cell * cell);
    *passes = 0;
    if (share < OWED_LEAST)
        return 0.0f;
    *passes = (int)fmin(ceil(share / PASS_MOST), passes_most);
    double each = fmin(share / *passes, PASS_MOST);
    *owed -= each * *passes * cell * cell;
    return (float)(each / 2.0);
}

static void begin(struct adaptive_global *g, struct adaptive_log *log)
{
    int one;
    for (int w = 0; w < g->likelihood->whiskers; w++)
        memset(g->factor[w], 0, (size_t)g->likelihood->model[w].codes * sizeof **g->factor);
    g->job = (struct adaptive_job){.running = true, .scale = (float)(1.0 / g->total)};
    gather(g, log);
    g->job.reference = exponentiate(g);
    g->job.side = side_of(&g->owed_position, g->cell, PASSES_MOST, &g->job.passes);
    g->job.side_heading = side_of(&g->owed_heading, g->cell_theta, 1, &one);
    g->job.turning = g->job.side_heading > 0.0f && !g->fresh;
    g->job.sized = g->peak * g->room >= g->problem->settings.adaptive_per_bin; /* else too many for a cloud */
    g->jobs++;
}

/* Ends a job; a row that fits nowhere, or that lost all mass beyond the walls, leaves nothing to believe. */
static void end(struct adaptive_global *g)
{
    uint64_t next = g->job.end;
    double gain = log(g->job.total) + g->job.reference - g->job.local - (g->fresh ? g->log_free : 0.0);
    if (!(g->job.total > 0.0 && isfinite(gain))) {
        adaptive_global_restart(g, next);
        return;
    }
    g->rotation = nav_wrap(g->rotation + g->job.step.theta);
    g->fresh = g->job.running = false;
    g->total = g->job.total;
    g->mode = g->job.mode;
    g->peak = (double)g->job.heaviest / g->total;
    g->gained += gain;
    g->next = next;
    adaptive_global_summarise(g);
}

static int lines_live(const struct adaptive_global *g, int p)
{
    int count = 0;
    for (int j = 0; j < g->ny; j++)
        count += g->live[p * g->ny + j];
    return count;
}

static float *line(const struct adaptive_global *g, float *mass, int p, int j)
{
    return mass + ((size_t)p * (size_t)g->ny + (size_t)j) * (size_t)g->nx;
}

/* Adds `side` of slice `from` to slice `to` in scratch, at the nearest cells of its other shift. */
static void pour(struct adaptive_global *g, int to, int from, float side)
{
    int dx = (int)floor((g->shift_x[from] - g->shift_x[to]) / g->cell + 0.5);
    int dy = (int)floor((g->shift_y[from] - g->shift_y[to]) / g->cell + 0.5);
    int first = dx > 0 ? 0 : -dx, last = dx > 0 ? g->nx - dx : g->nx;
    for (int j = 0; j < g->ny; j++) {
        if (!g->live[from * g->ny + j] || j + dy < 0 || j + dy >= g->ny)
            continue;
        const float *in = line(g, g->mass, from, j);
        float *out = line(g, g->scratch, to, j + dy) + dx;
        for (int i = first; i < last; i++)
            out[i] += side * in[i];
    }
}

/* One slice of the heading blur, into scratch. */
static void turn_slice(struct adaptive_global *g, int p)
{
    float side = g->job.side_heading, centre = 1.0f - 2.0f * side;
    int before = (p + g->nh - 1) % g->nh, after = (p + 1) % g->nh;
    for (int j = 0; j < g->ny; j++) {
        const float *in = line(g, g->mass, p, j);
        float *out = line(g, g->scratch, p, j);
        for (int i = 0; i < g->nx; i++)
            out[i] = centre * in[i];
    }
    pour(g, p, before, side);
    pour(g, p, after, side);
    g->touched += 3 * (long)slice_cells(g);
}

/* After the heading blur: scratch becomes the belief. */
static void end_turning(struct adaptive_global *g)
{
    float *blurred = g->scratch;
    g->scratch = g->mass;
    g->mass = blurred;
    g->job.turning = false;
    g->job.slice = 0;
    memset(g->live, 1, (size_t)g->nh * (size_t)g->ny); /* which lines gained mass, the next pass finds out */
}

static int carry(double *shift, double by, double cell, int most)
{
    double whole = floor((*shift + by) / cell + 0.5);
    *shift += by - whole * cell;
    return (int)fmax(fmin(whole, most), -most);
}

/* Moves a slice by whole cells; what enters is empty. */
static void roll(struct adaptive_global *g, int p, int dx, int dy)
{
    if (dx == 0 && dy == 0)
        return;
    float *slice = line(g, g->mass, p, 0);
    size_t bytes = (size_t)g->nx * sizeof *slice;
    memcpy(g->scratch, slice, slice_cells(g) * sizeof *slice);
    uint8_t *live = g->live + p * g->ny, *was = (uint8_t *)(g->scratch + slice_cells(g));
    memcpy(was, live, (size_t)g->ny);
    for (int j = 0; j < g->ny; j++) {
        int from = j - dy;
        live[j] = from >= 0 && from < g->ny && was[from];
        float *out = slice + (size_t)j * (size_t)g->nx;
        memset(out, 0, bytes);
        if (live[j] && abs(dx) < g->nx) {
            const float *in = g->scratch + (size_t)from * (size_t)g->nx;
            memcpy(out + (dx > 0 ? dx : 0), in + (dx > 0 ? 0 : -dx), bytes - (size_t)abs(dx) * sizeof *out);
        }
    }
}

static void blur_line(const float *in, float *out, int n, float side)
{
    float centre = 1.0f - 2.0f * side;
    for (int i = 1; i + 1 < n; i++)
        out[i] = centre * in[i] + side * (in[i - 1] + in[i + 1]);
    out[0] = centre * in[0] + (n > 1 ? side * in[1] : 0.0f);
    if (n > 1)
        out[n - 1] = centre * in[n - 1] + side * in[n - 2];
}

/* One pass of a three-point blur along x and y. */
static void blur_slice(struct adaptive_global *g, int p, float side)
{
    uint8_t *live = g->live + p * g->ny, *was = (uint8_t *)(g->scratch + slice_cells(g));
    memcpy(was, live, (size_t)g->ny);
    for (int j = 0; j < g->ny; j++) {
        if (was[j])
            blur_line(line(g, g->mass, p, j), g->scratch + j * g->nx, g->nx, side);
        else
            memset(g->scratch + j * g->nx, 0, (size_t)g->nx * sizeof *g->scratch);
    }
    for (int j = 0; j < g->ny; j++) {
        bool below = j > 0 && was[j - 1], above = j + 1 < g->ny && was[j + 1];
        live[j] = was[j] || below || above;
        if (!live[j])
            continue;
        const float *row = g->scratch + j * g->nx, *low = below ? row - g->nx : row, *high = above ? row + g->nx : row;
        float a = below ? side : 0.0f, b = above ? side : 0.0f, centre = 1.0f - 2.0f * side;
        float *out = line(g, g->mass, p, j);
        for (int i = 0; i < g->nx; i++)
            out[i] = centre * row[i] + a * low[i] + b * high[i];
    }
}

/* Works out a signature's likelihood for the present job. */
static float value_of(struct adaptive_global *g, uint32_t signature)
{
    const uint8_t *codes = g->expected->codes + signature * ((size_t)g->expected->whiskers + 1);
    float product = signature ? 1.0f : 0.0f;
    for (int w = 0; signature && w < g->expected->whiskers; w++)
        product *= g->factor[w][codes[w]];
    g->distinct++;
    g->value[signature] = (struct adaptive_value){g->jobs, product};
    return product;
}

/* Power of two of a mass up to 1, as an index: 0 for 1/2 .. 1. */
static int size_of(float mass)
{
    uint32_t bits;
    memcpy(&bits, &mass, sizeof bits);
    int size = 126 - (int)(bits >> 23);
    return size < 0 ? 0 : size < ADAPTIVE_SIZES ? size : ADAPTIVE_SIZES - 1;
}

/* Counts a line's cells by the size of their mass. */
static void count_line(struct adaptive_global *g, const float *cell)
{
    for (int i = 0; i < g->nx; i++)
        g->job.many[size_of(cell[i])]++;
}

/* Weighs one line of cells; returns its mass. */
static double weigh_line(struct adaptive_global *g, float *cell, const uint32_t *signature)
{
    float scale = g->job.scale, heaviest = g->job.heaviest, total = 0.0f;
    const struct adaptive_value *value = g->value;
    uint32_t jobs = g->jobs;
    int n = g->nx, mode = -1;
    for (int i = 0; i < n; i++) {
        float before = cell[i] * scale;
        if (!(before > SHARE_LEAST)) {
            cell[i] = 0.0f;
            continue;
        }
        uint32_t code = signature[i * SUB];
        float mass = before * (value[code].job == jobs ? value[code].value : value_of(g, code));
        cell[i] = mass;
        total += mass;
        if (mass > heaviest) {
            heaviest = mass;
            mode = i;
        }
    }
    if (mode >= 0) {
        g->job.heaviest = heaviest;
        g->job.mode = (size_t)(cell + mode - g->mass);
    }
    return (double)total;
}

/* Adds a line's moments about the arena's corner to its slice's. */
static void add_moments(struct adaptive_global *g, int p, int j, const float *cell)
{
    float mass = 0.0f, first = 0.0f, second = 0.0f, x = (float)(0.5 * g->cell + g->shift_x[p]);
    for (int i = 0; i < g->nx; i++) {
        float at = x + (float)i * (float)g->cell, part = cell[i] * at;
        mass += cell[i];
        first += part;
        second += part * at;
    }
    double y = (j + 0.5) * g->cell + g->shift_y[p], *m = g->moment + 6 * p;
    const double add[6] = {(double)mass,   (double)first,     y * (double)mass,
                           (double)second, y * (double)first, y * y * (double)mass};
    for (int k = 0; k < 6; k++)
        m[k] += add[k];
}

static void weigh_slice(struct adaptive_global *g, int p)
{
    memset(g->moment + 6 * p, 0, 6 * sizeof *g->moment);
    double heading = ((p + 0.5) * g->cell_theta + g->rotation + g->job.step.theta) / (2.0 * NAV_PI);
    int k = (int)((heading - floor(heading)) * g->expected->nh) % g->expected->nh;
    int x = (int)floor(0.5 * SUB + g->shift_x[p] / g->expected->step);
    double y = 0.5 * SUB + g->shift_y[p] / g->expected->step;
    for (int j = 0; j < g->ny; j++) {
        if (!g->live[p * g->ny + j])
            continue;
        const uint32_t *signature = nav_expected_row(g->expected, k, (int)floor(y + j * SUB)) + x;
        double mass = weigh_line(g, line(g, g->mass, p, j), signature);
        g->job.total += mass;
        g->live[p * g->ny + j] = mass > 0.0;
        if (!(mass > 0.0))
            continue;
        add_moments(g, p, j, line(g, g->mass, p, j));
        if (g->job.sized)
            count_line(g, line(g, g->mass, p, j));
    }
}

static void move_slice(struct adaptive_global *g, int p)
{
    if (g->fresh) {
        float each = (float)(1.0 / (double)adaptive_global_cells(g));
        for (size_t i = 0; i < slice_cells(g); i++)
            line(g, g->mass, p, 0)[i] = each;
        memset(g->live + p * g->ny, 1, (size_t)g->ny);
    }
    double heading = (p + 0.5) * g->cell_theta + g->rotation, c = cos(heading), s = sin(heading);
    int dx = carry(&g->shift_x[p], c * g->job.step.x - s * g->job.step.y, g->cell, g->nx);
    int dy = carry(&g->shift_y[p], s * g->job.step.x + c * g->job.step.y, g->cell, g->ny);
    if (!g->fresh) { /* uniform stays uniform: what would enter is as likely as what leaves */
        roll(g, p, dx, dy);
        for (int pass = 0; pass < g->job.passes; pass++)
            blur_slice(g, p, g->job.side);
    }
    weigh_slice(g, p);
}

/* Cells that the job's next slice may touch, at most. */
static long cost(const struct adaptive_global *g)
{
    if (g->job.turning)
        return 3 * (long)slice_cells(g);
    int lines = g->fresh ? g->ny : lines_live(g, g->job.slice) + 2 * g->job.passes;
    return (long)(lines < g->ny ? lines : g->ny) * g->nx * (3 + g->job.passes);
}

void adaptive_global_work(struct adaptive_global *g, struct adaptive_log *log, long budget)
{
    long most = g->touched + budget;
    if (g->next < adaptive_log_tail(log)) /* slept too long, or fell behind: what is lost is lost */
        adaptive_global_restart(g, adaptive_log_tail(log));
    while (g->job.running || g->next < log->head) {
        if (!g->job.running)
            begin(g, log);
        long next = cost(g);
        if (g->touched + next > most)
            return;
        if (g->job.turning) {
            turn_slice(g, g->job.slice);
        } else {
            g->touched += next;
            move_slice(g, g->job.slice);
        }
        if (++g->job.slice < g->nh)
            continue;
        if (g->job.turning)
            end_turning(g);
        else
            end(g);
    }
}
