#include "grid_mapper.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "gaussian.h"
#include "grid_particle.h"
#include "grid_view.h"

static const double SCALE_LEAST = 0.3, SCALE_MOST = 1.5; /* of the noise that the robot claims for its odometry */
static const double RESAMPLE = 0.5;                      /* effective share of the particles */
enum {
    PARTICLES = 100,
    PARTICLES_MOST = 5000,
    POOL_BYTES = 165000000,
    LEAVES_EACH = 1024,
    STREAM = 22,
    ROW_LEAVES = 4
};

struct nav_grid_mapper {
    struct nav_record record;
    int particles;
    bool surface;
    struct nav_grid_pool pool;
    struct nav_grid_particle *particle, *next; /* [particles] */
    struct nav_grid_rows rows;
    struct nav_touches touches;
    uint64_t loose; /* a bit for each touch that is of no line yet */
    double evidence;
    struct nav_rng rng;
};

static int grid_init(struct nav_grid_mapper *m, const struct nav_problem *problem)
{
    struct nav_record *record = &m->record;
    if (nav_record_init(record, problem))
        return -1;
    size_t each = nav_grid_pool_each(record->classes), count = (size_t)m->particles;
    size_t leaves = POOL_BYTES / each < LEAVES_EACH * count ? POOL_BYTES / each : LEAVES_EACH * count;
    m->particle = calloc(count, sizeof *m->particle);
    m->next = calloc(count, sizeof *m->next);
    if (nav_grid_rows_init(&m->rows, record) || nav_grid_pool_init(&m->pool, record->classes, (uint32_t)leaves) ||
        !m->particle || !m->next)
        return -1;
    for (int n = 0; n < m->particles; n++) {
        m->particle[n].scale = SCALE_LEAST * pow(SCALE_MOST / SCALE_LEAST, nav_rng_uniform(&m->rng));
        nav_grid_particle_begin(&m->particle[n], &m->rows);
    }
    return 0;
}

struct nav_grid_mapper_options nav_grid_mapper_default(void)
{
    return (struct nav_grid_mapper_options){.particles = PARTICLES, .surface = true};
}

struct nav_grid_mapper *nav_grid_mapper_new(const struct nav_problem *problem,
                                            const struct nav_grid_mapper_options *options)
{
    struct nav_grid_mapper *m = calloc(1, sizeof *m);
    if (!m || options->particles < 1 || options->particles > PARTICLES_MOST) {
        free(m);
        return NULL;
    }
    m->particles = options->particles;
    m->surface = options->surface;
    nav_rng_seed(&m->rng, problem->seed, STREAM);
    if (grid_init(m, problem)) {
        nav_grid_mapper_free(m);
        return NULL;
    }
    return m;
}

void nav_grid_mapper_free(struct nav_grid_mapper *m)
{
    if (!m)
        return;
    nav_record_free(&m->record);
    nav_grid_pool_free(&m->pool);
    nav_grid_rows_free(&m->rows);
    free(m->particle);
    free(m->next);
    free(m);
}

static struct nav_grid_particle *grid_best(const struct nav_grid_mapper *m)
{
    struct nav_grid_particle *best = m->particle;
    for (int n = 1; n < m->particles; n++)
        best = m->particle[n].weight > best->weight ? &m->particle[n] : best;
    return best;
}

/* Systematic resampling (Kitagawa 1996): copies of a particle stand side by side, and share its map. */
static void grid_resample(struct nav_grid_mapper *m, double best, double total)
{
    double step = total / m->particles, at = nav_rng_uniform(&m->rng) * step, sum = 0.0;
    int from = -1;
    for (int n = 0; n < m->particles; n++) {
        while (from < m->particles - 1 && (from < 0 || sum <= at))
            sum += exp(m->particle[++from].weight - best);
        struct nav_grid_map map = m->next[n].map;
        m->next[n] = m->particle[from];
        m->next[n].map = map;
        nav_grid_map_copy(&m->pool, &m->next[n].map, &m->particle[from].map);
        m->next[n].weight = 0.0;
        at += step;
    }
    for (int n = 0; n < m->particles; n++)
        nav_grid_map_clear(&m->pool, &m->particle[n].map);
    struct nav_grid_particle *old = m->particle;
    m->particle = m->next;
    m->next = old;
}

/* Weights are relative to their mean from here on, whose log goes into the evidence. */
static void grid_settle(struct nav_grid_mapper *m)
{
    double best = grid_best(m)->weight, total = 0.0, square = 0.0;
    for (int n = 0; n < m->particles; n++) {
        double w = exp(m->particle[n].weight - best);
        total += w;
        square += w * w;
    }
    double mean = best + log(total / m->particles);
    m->evidence += mean;
    bool full = m->pool.spare_leaves < (uint32_t)(ROW_LEAVES * m->particles);
    if (total * total < RESAMPLE * m->particles * square || full)
        grid_resample(m, best, total);
    else
        for (int n = 0; n < m->particles; n++)
            m->particle[n].weight -= mean;
}

/* Looks for a line through this row's contacts; each contact is of one line. */
static void grid_line(struct nav_grid_mapper *m, const struct nav_record_row *row)
{
    double sigma = m->rows.robot->radial_sigma;
    m->rows.lined = false;
    nav_touches_move(&m->touches, row->step, row->noise);
    for (int ray = 0; ray < m->rows.rays; ray++) {
        const struct nav_record_contact *c = &row->contact[ray];
        const struct nav_place *at = &m->rows.ray[ray].place;
        if (!(c->weight > 0.0F) || isinf(c->distance))
            continue;
        int place = nav_touches_keep(&m->touches,
                                     (struct nav_touch){.x = at->x + (double)c->distance * at->c,
                                                        .y = at->y + (double)c->distance * at->s,
                                                        .along_x = at->c,
                                                        .along_y = at->s,
                                                        .variance = sigma * sigma,
                                                        .normal = (double)c->normal,
                                                        .normal_var = (double)c->normal_sd * (double)c->normal_sd});
        m->loose = (m->loose | 1ULL << place) & m->touches.held;
        if (!m->rows.lined && nav_touches_fit(&m->touches, place, m->loose, &m->rows.line)) {
            m->rows.lined = true;
            m->loose &= ~m->rows.line.used;
        }
    }
}

/* Of a row's noise, what is not the odometry's usual error: motion that was not reported. */
static struct nav_noise grid_lost(const struct nav_grid_mapper *m, const struct nav_record_row *row)
{
    struct nav_motion motion = {.step = row->step};
    struct nav_noise usual = nav_motion_noise(m->rows.robot, m->rows.settings, &motion);
    return (struct nav_noise){row->noise.position > 1.01 * usual.position ? row->noise.position - usual.position : 0.0,
                              row->noise.heading > 1.01 * usual.heading ? row->noise.heading - usual.heading : 0.0};
}

static void grid_estimate(const struct nav_grid_mapper *m, struct nav_estimate *out)
{
    const struct nav_grid_particle *best = grid_best(m);
    struct nav_gaussian_sum sum = {.about = {best->now.mean[0], best->now.mean[1], best->now.mean[2]}};
    for (int n = 0; n < m->particles; n++) {
        const struct nav_grid_gaussian *p = &m->particle[n].now;
        struct nav_gaussian g = {.mean = {p->mean[0], p->mean[1], p->mean[2]}};
        for (int r = 0; r < 9; r++)
            g.covariance[r] = p->cov[r / 3][r % 3];
        nav_gaussian_sum_add(&sum, exp(m->particle[n].weight - best->weight), &g);
    }
    struct nav_gaussian all = nav_gaussian_sum_moments(&sum);
    nav_gaussian_estimate(&all, out);
}

static void grid_take(struct nav_grid_mapper *m, const struct nav_record_row *row)
{
    bool draw = nav_grid_rows_keep(&m->rows, row) || m->rows.count == NAV_GRID_ROWS_MOST;
    grid_line(m, row);
    struct nav_noise lost = grid_lost(m, row);
    for (int n = 0; n < m->particles; n++) {
        struct nav_grid_particle *p = &m->particle[n];
        struct nav_grid_odometry odometry = nav_grid_particle_odometry(p, &m->rows);
        nav_grid_gaussian_move(&p->now, &odometry, row->step, lost);
        if (draw)
            nav_grid_particle_draw(p, &m->pool, &m->rows, m->surface, &m->rng);
    }
    if (draw) {
        grid_settle(m);
        m->rows.count = 0;
    }
}

void nav_grid_mapper_step(struct nav_grid_mapper *m, const struct nav_row *row, struct nav_estimate *out)
{
    struct nav_record_row taken = nav_record_at(&m->record, nav_record_take(&m->record, row));
    grid_take(m, &taken);
    *out = (struct nav_estimate){.states = m->particles, .touched = m->particles, .evaluations = m->particles};
    grid_estimate(m, out);
    out->bytes =
        nav_grid_pool_bytes(&m->pool) + 2 * (size_t)m->particles * sizeof *m->particle + nav_record_bytes(&m->record);
}

static void grid_step(void *mapper, const struct nav_row *row, struct nav_estimate *out)
{
    nav_grid_mapper_step(mapper, row, out);
}

void nav_grid_mapper_replay(struct nav_grid_mapper *m, const struct nav_rows *rows, long first, long count,
                            struct nav_estimate *out, double *step_us)
{
    nav_replay_steps(grid_step, m, rows, first, count, out, step_us);
}

double nav_grid_mapper_evidence(const struct nav_grid_mapper *m)
{
    return m->evidence;
}

static struct nav_grid grid_view(const struct nav_grid_mapper *m)
{
    return (struct nav_grid){(struct nav_grid_pool *)&m->pool, &grid_best(m)->map};
}

long nav_grid_mapper_faces(const struct nav_grid_mapper *m, struct nav_mapper_face *out, long room)
{
    return nav_grid_view_faces(grid_view(m), out, room);
}

struct nav_mapper_grid nav_grid_mapper_grid(const struct nav_grid_mapper *m)
{
    return nav_grid_view_cells(grid_view(m));
}

void nav_grid_mapper_occupancy(const struct nav_grid_mapper *m, float *out)
{
    nav_grid_view_occupancy(grid_view(m), out);
}

uint64_t nav_grid_mapper_bad_cells(const struct nav_grid_mapper *m)
{
    return m->record.intake.bad_cells;
}

uint64_t nav_grid_mapper_bad_rows(const struct nav_grid_mapper *m)
{
    return m->record.intake.bad_rows;
}
