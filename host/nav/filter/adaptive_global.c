/* Rows of the log on their way into the arena-wide belief, a job at a time and a job slice by slice. */
#include "adaptive_global.h"

#include <math.h>
#include <string.h>

#include "adaptive_global_parts.h"

/* Variance is saved up to this share of a squared cell edge, and paid in passes of at most so much (lattice.c). */
static const double OWED_LEAST = 0.04, PASS_MOST = 0.5;

/* A debt that would take more jobs than this is not paid: who may have moved that far unseen may be anywhere. */
static const double JOBS_OWED_MOST = 16.0;

/* Likelihood of standing where the map says one cannot, by that of sensors that are all broken: maps are wrong
 * sometimes, and of a cell that is blocked at its middle a part may be free. */
static const double BLOCKED = 1e-3;

/* A job's rows read, its motion planned and its answer found take as long as passing over about so many cells. */
enum { JOB_CELLS = 10000 };

bool adaptive_global_current(const struct adaptive_global *g, const struct adaptive_log *log)
{
    return g->next == log->head && !g->job.running;
}

/* Adds one row's tables to the factors, as logarithms, and what the local belief made of it. */
static void read_row(struct adaptive_global *g, struct adaptive_log *log, uint64_t row)
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
static void move_row(struct adaptive_global *g, const struct adaptive_entry *entry)
{
    double along_m = g->problem->settings.motion_along_m;
    g->job.step = nav_compose(g->job.step, entry->step);
    g->owed_position += entry->noise.position + nav_slice_fan(entry->step, g->cell_theta, along_m);
    g->owed_heading += entry->noise.heading;
}

/* How far the whiskers have gone in the job so far, m. */
static double path(const struct adaptive_job *job)
{
    return hypot(job->step.x, job->step.y) + 0.2 * fabs(job->step.theta);
}

/* Rows between which nothing is read while the belief is too wide to keep up: the further behind, the longer the way.
 * Their motion counts (as the paper drops readings, odometry never). Returns the first row to be read. */
static uint64_t skip(struct adaptive_global *g, struct adaptive_log *log)
{
    double late = (double)(log->head - g->next) / ADAPTIVE_ROWS_LATE - 1.0;
    uint64_t row = g->next, reach = adaptive_log_reach(log);
    while (row < reach ||
           (path(&g->job) < late * g->cell && row + 1 < log->head && !adaptive_log_entry(log, row)->sharp))
        move_row(g, adaptive_log_entry(log, row++));
    return row;
}

/* Gathers rows; a contact is too sharp to be read at another's place. */
static void gather(struct adaptive_global *g, struct adaptive_log *log)
{
    uint64_t row = skip(g, log);
    move_row(g, adaptive_log_entry(log, row));
    read_row(g, log, row);
    bool sharp = adaptive_log_entry(log, row)->sharp;
    struct nav_pose first = g->job.step;
    for (row++; row < log->head && !sharp; row++) {
        const struct adaptive_entry *entry = adaptive_log_entry(log, row);
        struct adaptive_job ahead = {.step = {g->job.step.x - first.x + entry->step.x,
                                              g->job.step.y - first.y + entry->step.y,
                                              g->job.step.theta - first.theta + entry->step.theta}};
        if (entry->sharp || path(&ahead) > g->cell)
            break;
        move_row(g, entry);
        read_row(g, log, row);
    }
    g->job.end = row;
}

/* Sum of the whiskers' best logarithms, which expected observations are weighed relative to. */
static double best_codes(const struct adaptive_global *g)
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

static bool unpayable(const struct adaptive_global *g)
{
    double most = JOBS_OWED_MOST * PASS_MOST;
    return g->owed_position > ADAPTIVE_PASSES_MOST * most * g->cell * g->cell ||
           g->owed_heading > most * g->cell_theta * g->cell_theta;
}

static void read_job(struct adaptive_global *g, struct adaptive_log *log)
{
    for (int w = 0; w < g->likelihood->whiskers; w++)
        memset(g->factor[w], 0, (size_t)g->likelihood->model[w].codes * sizeof **g->factor);
    g->job = (struct adaptive_job){.running = true, .scale = (float)(1.0 / g->total)};
    gather(g, log);
}

static void begin(struct adaptive_global *g, struct adaptive_log *log)
{
    int one;
    read_job(g, log);
    if (!g->fresh && unpayable(g)) {
        adaptive_global_restart(g, g->next);
        read_job(g, log);
    }
    if (g->fresh) /* nothing blurs what is uniform */
        g->owed_position = g->owed_heading = 0.0;
    g->job.reference = best_codes(g);
    g->value[0] = (float)(BLOCKED * exp(-g->job.reference));
    nav_expected_prepare(g->expected, (const float *const *)g->factor);
    g->job.side = side_of(&g->owed_position, g->cell, ADAPTIVE_PASSES_MOST, &g->job.passes);
    g->job.side_heading = side_of(&g->owed_heading, g->cell_theta, 1, &one);
    g->job.phase = g->job.side_heading > 0.0f && !g->fresh ? ADAPTIVE_TURN : ADAPTIVE_MOVE;
    g->job.about = nav_compose(g->summary.belief.mean, g->job.step);
    adaptive_global_forget_values(g);
}

/* The first stored cell that is as heavy as the heaviest. */
static size_t mode(const struct adaptive_global *g)
{
    size_t n = (size_t)g->job.mode_slice * (size_t)g->ny * (size_t)g->pitch;
    while (g->mass[n] < g->job.heaviest)
        n++;
    return n;
}

/* Ends a job; a row that fits nowhere, or that lost all mass beyond the walls, leaves nothing to believe. `many`: its
 * cells have not been counted. */
static void end(struct adaptive_global *g, bool many)
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
    g->mode = mode(g);
    g->scattered = many ? 1.0 : g->job.light / g->total;
    g->crowd = g->job.crowd;
    g->gained += gain;
    g->next = next;
    adaptive_global_summarise(g);
}

/* Does the job's next slice; false: that would take more than `most` cells. */
static bool next_slice(struct adaptive_global *g, long most)
{
    static long (*const part[])(struct adaptive_global *, int, long) = {[ADAPTIVE_TURN] = adaptive_global_turn,
                                                                        [ADAPTIVE_MOVE] = adaptive_global_move,
                                                                        [ADAPTIVE_COUNT] = adaptive_global_count};
    long touched = part[g->job.phase](g, g->job.slice, most);
    g->touched += touched > 0 ? touched : 0;
    g->job.slice += touched >= 0;
    return touched >= 0;
}

/* From a phase that is done to the next. */
static void next_phase(struct adaptive_global *g)
{
    enum adaptive_phase done = g->job.phase;
    g->job.slice = 0;
    if (done == ADAPTIVE_TURN)
        adaptive_global_turned(g);
    g->job.phase = done == ADAPTIVE_TURN ? ADAPTIVE_MOVE : ADAPTIVE_COUNT;
    g->job.worth = g->job.total / g->room;
    /* While even the heaviest cell is worth less than several hypotheses there are too many for a cloud. */
    bool many = (double)g->job.heaviest < g->problem->settings.adaptive_per_bin * g->job.worth;
    if (done == ADAPTIVE_COUNT || (done == ADAPTIVE_MOVE && (many || !(g->job.total > 0.0))))
        end(g, many);
}

void adaptive_global_work(struct adaptive_global *g, struct adaptive_log *log, long budget)
{
    long most = g->touched + budget;
    if (log->head - g->next > ADAPTIVE_ROWS_KEPT) /* rows that it has not seen are overwritten */
        adaptive_global_restart(g, adaptive_log_reach(log));
    while (g->job.running || g->next < log->head) {
        if (!g->job.running) {
            if (g->touched + JOB_CELLS > most)
                return;
            g->touched += JOB_CELLS;
            begin(g, log);
        }
        if (!next_slice(g, most - g->touched))
            return;
        if (g->job.slice == g->nh)
            next_phase(g);
    }
}
