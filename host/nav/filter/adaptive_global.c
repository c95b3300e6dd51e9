/* Rows of the log on their way into the arena-wide belief, a job at a time. */
#include "adaptive_global.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "mixture.h"

/* A debt of noise that would take more jobs than this is not paid: who may have moved that far unseen may be anywhere.
 */
static const double JOBS_OWED_MOST = 16.0;

/* Likelihood of standing where the map says one cannot, by that of sensors that are all broken: maps are wrong
 * sometimes. */
static const double BLOCKED = 1e-3;

/* Cells passed over in a row, at 10 ns each: no further job begins beyond them, so that a row takes 10 ms at most where
 * a pass over the whole arena takes no longer. What one pose expects takes as long as passing over so many. */
enum { ROW_CELLS = 500000, EXPECT_CELLS = 20 };

/* Poses that stand for a cell: per edge, and per heading. */
enum { SUB = 2, TURNS = 1 };

/* Cells that a belief may have after it has been refined. */
enum { REFINED_MOST = 8192 };

/* Widest heading of a coarse level. */
static const double HEADING_MOST = 24.0 * NAV_PI / 180.0;

/* The table of what the first level's cells expect takes memory and set-up: cells that it may have at most. */
static const double CELLS_MOST = 1.3e6;

bool adaptive_global_current(const struct adaptive_global *g, const struct adaptive_log *log)
{
    return g->next == log->head;
}

/* Adds one row's tables to the factors, as logarithms, and what the local belief made of it. */
static void global_read_row(struct adaptive_global *g, struct adaptive_log *log, uint64_t row)
{
    struct nav_evidence evidence = adaptive_log_replay(log, row);
    nav_likelihood_read(g->likelihood, &evidence);
    g->job.local += adaptive_log_entry(log, row)->local;
    for (int w = 0; w < g->likelihood->whiskers; w++) {
        for (int k = 0; k < g->likelihood->model[w].codes; k++)
            g->factor[w][k] += g->likelihood->table[w][k];
    }
}

/* Adds one row's motion, and the noise that it and the width of slices bring. */
static void global_move_row(struct adaptive_global *g, const struct adaptive_entry *entry)
{
    double along_m = g->problem->settings.motion.along_m;
    g->job.step = nav_compose(g->job.step, entry->step);
    g->histogram.pending_position += entry->noise.position + nav_histogram_fan(&g->histogram, entry->step, along_m);
    g->histogram.pending_heading += entry->noise.heading;
}

/* How far the sensor of the finest detail has gone in a step, m. */
static double global_path(const struct adaptive_global *g, struct nav_pose step)
{
    return hypot(step.x, step.y) + g->cell.lever * fabs(step.theta);
}

/* Rows between which nothing is read while the belief is too wide to keep up: the further behind, the longer the way.
 * Their motion counts (as the paper drops readings, odometry never). Returns the first row to be read. */
static uint64_t global_skip(struct adaptive_global *g, struct adaptive_log *log)
{
    double late = (double)(log->head - g->next) / ADAPTIVE_ROWS_LATE - 1.0, cell = g->histogram.shape.cell;
    uint64_t row = g->next, reach = adaptive_log_reach(log);
    while (row < reach ||
           (global_path(g, g->job.step) < late * cell && row + 1 < log->head && !adaptive_log_entry(log, row)->sharp))
        global_move_row(g, adaptive_log_entry(log, row++));
    return row;
}

/* Gathers rows; a contact is too sharp to be read at another's place. */
static void global_gather(struct adaptive_global *g, struct adaptive_log *log)
{
    uint64_t row = global_skip(g, log);
    global_move_row(g, adaptive_log_entry(log, row));
    global_read_row(g, log, row);
    bool sharp = adaptive_log_entry(log, row)->sharp;
    struct nav_pose since = {0.0, 0.0, 0.0};
    for (row++; row < log->head && !sharp; row++) {
        const struct adaptive_entry *entry = adaptive_log_entry(log, row);
        since = (struct nav_pose){since.x + entry->step.x, since.y + entry->step.y, since.theta + entry->step.theta};
        if (entry->sharp || global_path(g, since) > g->histogram.levels.cell)
            break;
        global_move_row(g, entry);
        global_read_row(g, log, row);
    }
    g->job.end = row;
}

/* Sum of the whiskers' best logarithms, which expected observations are weighed relative to. */
static double global_best(const struct adaptive_global *g)
{
    double sum = 0.0;
    for (int w = 0; w < g->likelihood->whiskers; w++) {
        float best = g->factor[w][0];
        for (int k = 1; k < g->likelihood->model[w].codes; k++)
            best = fmaxf(best, g->factor[w][k]);
        sum += (double)best;
    }
    return sum;
}

static void global_read_job(struct adaptive_global *g, struct adaptive_log *log)
{
    for (int w = 0; w < g->likelihood->whiskers; w++)
        memset(g->factor[w], 0, (size_t)g->likelihood->model[w].codes * sizeof **g->factor);
    g->job = (struct adaptive_job){.end = g->next};
    global_gather(g, log);
}

/* Likelihoods of a group of the first level's cells: from the table. */
static long global_look_up(void *self, int p, int line, int group, const float *mass, float *like)
{
    struct adaptive_global *g = self;
    const struct nav_histogram *h = &g->histogram;
    if (g->first.slice != p)
        g->first.layer = nav_expected_layer(g->expected, nav_histogram_heading(h, p), nav_histogram_shift_x(h, p),
                                            nav_histogram_shift_y(h, p));
    g->first.slice = p;
    nav_expected_mean(g->expected, &g->first.layer, line, group * NAV_LANES, mass, like);
    return NAV_LANES;
}

/* Likelihood of a pose, from the job's factors. */
static double global_at(const struct adaptive_global *g, const struct nav_place *at)
{
    const struct nav_likelihood *l = g->likelihood;
    double sum = 0.0;
    if (!nav_likelihood_clear(l, at->x, at->y, g->histogram.shape.cell / (2 * SUB)))
        return BLOCKED * exp(-g->job.reference);
    nav_likelihood_expect(l, at, l->scratch);
    for (int w = 0; w < l->whiskers; w++)
        sum += (double)g->factor[w][l->scratch[w]];
    return exp(sum - g->job.reference);
}

/* Likelihoods of a group of finer cells: worked out where there is mass. */
static long global_work_out(void *self, int p, int line, int group, const float *mass, float *like)
{
    struct adaptive_global *g = self;
    const struct nav_histogram *h = &g->histogram;
    double cell = h->shape.cell, step = cell / SUB, turn = h->shape.cell_theta / TURNS;
    double x0 = group * NAV_LANES * cell + nav_histogram_shift_x(h, p);
    double y0 = line * cell + nav_histogram_shift_y(h, p), sum[NAV_LANES] = {0.0};
    long poses = 0;
    for (int t = 0; t < TURNS; t++) {
        double heading = nav_histogram_heading(h, p) + (t - (TURNS - 1) / 2.0) * turn;
        struct nav_place at = {.c = cos(heading), .s = sin(heading)};
        for (int n = 0; n < NAV_LANES * SUB * SUB; n++) {
            int k = n / SUB / SUB;
            if (!(mass[k] > 0.0f))
                continue;
            at.x = x0 + k * cell + (n % SUB + 0.5) * step;
            at.y = y0 + (n / SUB % SUB + 0.5) * step;
            sum[k] += global_at(g, &at);
            poses++;
        }
    }
    for (int k = 0; k < NAV_LANES; k++)
        like[k] = (float)(sum[k] / (SUB * SUB * TURNS));
    return EXPECT_CELLS * poses;
}

/* What every cell is given of the chance that the robot was put there; finer cells than the first are not all held. */
static double global_hazard(struct adaptive_global *g, double hazard)
{
    double rows = (double)(g->job.end - g->hazarded);
    if (!(hazard > 0.0) || rows < NAV_HAZARD_ROWS || g->histogram.uniform || g->histogram.level != g->first.level)
        return 0.0;
    g->hazarded = g->job.end;
    return fmin(rows, NAV_HAZARD_ROWS) * hazard / nav_shape_inside(&g->histogram.shape);
}

static double global_prior(void *self, double x, double y)
{
    return nav_likelihood_prior(((struct adaptive_global *)self)->likelihood, x, y);
}

static void global_pass(struct adaptive_global *g, struct adaptive_log *log, double hazard)
{
    struct nav_histogram *h = &g->histogram;
    global_read_job(g, log);
    if (!h->uniform && nav_histogram_debt(h) > JOBS_OWED_MOST) {
        adaptive_global_restart(g, g->next);
        global_read_job(g, log);
    }
    bool first = h->level == g->first.level;
    g->first.slice = -1;
    g->job.uniform = h->uniform;
    g->job.reference = global_best(g);
    g->expected->unmapped = h->uniform ? g->likelihood->ground.weight : 1.0;
    if (first)
        nav_expected_begin(g->expected, (const float *const *)g->factor, (float)(BLOCKED * exp(-g->job.reference)));
    g->weigh = (struct nav_weigh){.group = first ? global_look_up : global_work_out,
                                  .self = g,
                                  .least = NAV_SHARE_LEAST / g->first.cells,
                                  .extra = global_hazard(g, hazard),
                                  .prior = global_prior};
    g->touched += nav_histogram_pass(h, g->job.step, &g->weigh, nav_compose(g->summary.mean, g->job.step));
}

/* The belief is that after the job's rows; a row that fits nowhere, or that lost all mass beyond the walls, leaves
 * nothing to believe. */
static void global_end(struct adaptive_global *g)
{
    uint64_t next = g->job.end;
    g->distinct += g->expected->knowns;
    double free = g->job.uniform ? log(fmax(g->expected->standing, 1e-9)) : 0.0;
    double gain = log(g->histogram.total) + g->job.reference - g->job.local - free;
    if (!(g->histogram.total > 0.0 && isfinite(gain))) {
        adaptive_global_restart(g, next);
        return;
    }
    g->gained += gain;
    g->next = next;
    g->summary.mass = nav_histogram_mode(&g->histogram, &g->summary.mean);
}

/* Counts cells worth a hypothesis. */
static void global_count(struct adaptive_global *g)
{
    const struct nav_histogram *h = &g->histogram;
    float worth = (float)(h->total / g->room);
    double light = 0.0;
    g->crowd = 0.0;
    for (size_t n = 0; n < (size_t)nav_histogram_groups(h) * NAV_LANES; n++) {
        light += h->now.mass[n] < worth ? (double)h->now.mass[n] : 0.0;
        g->crowd += h->now.mass[n] < worth ? 0.0 : 1.0;
    }
    g->scattered = light / h->total;
}

/* While even the heaviest cell is worth less than several hypotheses, or cells are still to be refined, there are too
 * many for a cloud. */
static void global_take_job(struct adaptive_global *g, struct adaptive_log *log, double hazard)
{
    struct nav_histogram *h = &g->histogram;
    global_pass(g, log, hazard);
    bool refined = h->level > 0 && h->total > 0.0 && 8 * h->cells <= REFINED_MOST && nav_histogram_refine(h);
    g->scattered = 1.0;
    global_end(g);
    if (!refined && !h->uniform && h->level == 0 && (double)h->heaviest * g->room >= ADAPTIVE_PER_BIN * h->total)
        global_count(g);
}

void adaptive_global_work(struct adaptive_global *g, struct adaptive_log *log, double hazard)
{
    if (log->head - g->next > ADAPTIVE_ROWS_KEPT) /* rows that it has not seen are overwritten */
        adaptive_global_restart(g, adaptive_log_reach(log));
    for (g->touched = g->distinct = 0; g->next != log->head && g->touched < ROW_CELLS;)
        global_take_job(g, log, hazard);
}

void adaptive_global_restart(struct adaptive_global *g, uint64_t row)
{
    const struct nav_arena *arena = &g->problem->arena;
    nav_histogram_restart(&g->histogram, g->first.level);
    g->next = g->hazarded = row;
    g->gained = 0.0;
    g->scattered = 1.0;
    g->summary.mean = nav_gaussian_uniform(arena).mean;
    g->summary.mass = NAV_PI * NAV_NEAR_M * NAV_NEAR_M / (arena->size_x * arena->size_y) * NAV_NEAR_RAD / NAV_PI;
}

void adaptive_global_clear(struct adaptive_global *g, uint64_t row)
{
    adaptive_global_restart(g, row);
    nav_histogram_clear(&g->histogram, 0);
}

struct squares {
    double sum;
};

static void global_square(void *self, struct nav_pose at, double mass)
{
    (void)at;
    ((struct squares *)self)->sum += mass * mass;
}

double adaptive_global_fill(struct adaptive_global *g)
{
    static const struct nav_pose still = {0.0, 0.0, 0.0};
    static const struct nav_weigh all = {.group = NULL};
    struct nav_histogram *h = &g->histogram;
    struct squares squares = {0.0};
    struct nav_shape finest = nav_levels_shape(&h->levels, 0);
    nav_mixture_fill(&g->problem->prior, h);
    nav_histogram_pass(h, still, &all, still);
    nav_histogram_each(h, global_square, &squares);
    g->summary.mass = nav_histogram_mode(h, &g->summary.mean);
    double finer = (double)nav_shape_cells(&finest) / (double)nav_shape_cells(&h->shape);
    return finer * h->total * h->total / squares.sum;
}

void adaptive_global_draw(struct adaptive_global *g, struct nav_particles *to, struct nav_rng *rng, long count,
                          double weight, struct nav_pose moved)
{
    long drawn = nav_histogram_draw(&g->histogram, rng, count, g->poses.drawn, (long)g->room);
    for (long n = 0; n < drawn; n++)
        nav_particles_add(to, nav_compose(g->poses.drawn[n], moved), weight / (double)count, rng);
}

struct sharing {
    const struct nav_mode *mode;
    int modes;
    double *share, total;
};

/* Adds a cell's mass to the mode that it is nearest to. */
static void global_share_cell(void *self, struct nav_pose at, double mass)
{
    const struct sharing *s = self;
    double least = NAV_MODE_REACH;
    int nearest = -1;
    for (int m = 0; m < s->modes; m++) {
        double far = nav_mode_distance(s->mode[m].mean, at);
        if (far > least)
            continue;
        least = far;
        nearest = m;
    }
    if (nearest >= 0)
        s->share[nearest] += mass / s->total;
}

void adaptive_global_share(const struct adaptive_global *g, const struct nav_mode *mode, int modes, double *share)
{
    struct sharing sharing = {mode, modes, share, g->histogram.total};
    memset(share, 0, (size_t)modes * sizeof *share);
    nav_histogram_each(&g->histogram, global_share_cell, &sharing);
}

void adaptive_global_add(struct adaptive_global *g, struct nav_pose pose, double share)
{
    double total = g->histogram.total > 0.0 ? g->histogram.total : 1.0;
    if (g->poses.grains < g->room)
        g->poses.grain[g->poses.grains++] = (struct nav_grain){.pose = pose, .mass = share * total};
}

void adaptive_global_added(struct adaptive_global *g)
{
    nav_histogram_add(&g->histogram, g->poses.grain, g->poses.grains);
    g->poses.grains = 0;
}

struct nav_pending adaptive_global_since(const struct adaptive_global *g, const struct adaptive_log *log,
                                         const struct nav_pending *pending)
{
    struct nav_pending since = adaptive_log_since(log, g->next);
    nav_pending_add(&since, pending->step, pending->noise);
    return since;
}

static int global_levels(struct adaptive_global *g, struct nav_levels *levels)
{
    const struct nav_problem *problem = g->problem;
    if (nav_problem_cell(problem, 0.0, &g->cell))
        return -1;
    *levels = (struct nav_levels){problem->arena.size_x, problem->arena.size_y, g->cell.edge, 0, 0};
    levels->headings = (nav_cell_headings(&g->cell) + 3) / 4 * 4;
    levels->headings_least = (int)(2.0 * NAV_PI / HEADING_MOST);
    return 0;
}

/* The finest level whose cells are passed over in a row; where these are too wide for the detail, one that is not, or
 * that the table has room for. */
static int global_first_level(const struct adaptive_global *g, const struct nav_levels *levels)
{
    enum { LEVELS = 16 };
    const double few = ROW_CELLS / 2; /* each is passed over and weighed */
    for (int level = 0; level < LEVELS; level++) {
        struct nav_shape shape = nav_levels_shape(levels, level);
        double cells = nav_shape_inside(&shape);
        if ((g->open * cells <= few && cells <= CELLS_MOST) ||
            (2.0 * shape.cell > g->cell.pattern / 2.0 && cells <= CELLS_MOST))
            return level;
    }
    return LEVELS;
}

static int global_tables(struct adaptive_global *g)
{
    const struct nav_problem *problem = g->problem;
    const struct nav_shape *s = &g->histogram.shape;
    double blur = nav_cell_blur(s->cell, s->cell_theta, g->cell.lever, SUB, TURNS);
    g->likelihood = nav_likelihood_new(&problem->arena, &problem->robot, &problem->settings, blur);
    if (!g->likelihood)
        return -1;
    g->expected = nav_expected_new(g->likelihood, s->cell, s->nh, SUB, TURNS);
    g->factor = calloc((size_t)g->likelihood->whiskers + 1, sizeof *g->factor);
    for (int w = 0; g->factor && w < g->likelihood->whiskers; w++) {
        g->factor[w] = calloc((size_t)g->likelihood->model[w].codes, sizeof **g->factor);
        if (!g->factor[w])
            return -1;
    }
    return g->expected && g->factor ? 0 : -1;
}

int adaptive_global_init(struct adaptive_global *g, const struct nav_problem *problem, const struct nav_ground *ground)
{
    struct nav_levels levels;
    *g = (struct adaptive_global){
        .problem = problem, .room = floor(problem->settings.adaptive.most), .open = ground->open};
    if (global_levels(g, &levels))
        return -1;
    g->first.level = global_first_level(g, &levels);
    struct nav_shape first = nav_levels_shape(&levels, g->first.level);
    g->first.cells = nav_shape_inside(&first);
    g->first.too_wide = 2.0 * first.cell > g->cell.pattern ? first.cell : 0.0;
    g->poses.drawn = calloc((size_t)g->room + 1, sizeof *g->poses.drawn);
    g->poses.grain = calloc((size_t)g->room + 1, sizeof *g->poses.grain);
    if (!g->poses.drawn || !g->poses.grain ||
        nav_histogram_init(&g->histogram, &levels, g->first.level, 8L * REFINED_MOST) || global_tables(g))
        return -1;
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
    nav_histogram_free(&g->histogram);
    free(g->poses.drawn);
    free(g->poses.grain);
}

size_t adaptive_global_cells(const struct adaptive_global *g)
{
    return (size_t)nav_shape_inside(&g->histogram.shape);
}

size_t adaptive_global_bytes(const struct adaptive_global *g)
{
    return nav_histogram_bytes(&g->histogram) + nav_expected_bytes(g->expected);
}
