#define _POSIX_C_SOURCE 200809L /* clock_gettime */

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "mapper_state.h"

static const double SCALE_LEAST = 0.3, SCALE_MOST = 1.5; /* of the odometry's noise */
static const double BEHIND = 30.0;                       /* nats at which a particle is given up */
static const double MARGIN = 3.0;                        /* nats by which a new lattice must be better */
static const double GROWN = 1.25;                        /* of the borders, since a lattice was sought last */
static const double REFUSED = 5.0;                       /* nats against a lattice at which it is given up */
static const double RIGHT_MOST = 0.15;                   /* rad between a lattice and faces that stand along it */
enum { PARTICLES = 12, PARTICLES_MOST = 5000, SCALES = 4, CATCH_UP = 60, STREAM = 21 };

struct nav_mapper_options nav_mapper_default(void)
{
    return (struct nav_mapper_options){.particles = PARTICLES, .lattice = true};
}

/* Particles take the scales in turn. */
static double mapper_scale(int particle, int count)
{
    double share = (particle % SCALES) / (SCALES - 1.0);
    return count < SCALES ? 1.0 : SCALE_LEAST * pow(SCALE_MOST / SCALE_LEAST, share);
}

static int mapper_init(struct nav_mapper *m)
{
    const struct nav_problem *problem = m->problem;
    int failed = nav_record_init(&m->record, problem);
    failed |= nav_trail_init(&m->trail, &problem->arena, &problem->robot);
    failed |= nav_trail_init(&m->challenger_trail, &problem->arena, &problem->robot);
    failed |= nav_lattice_search_init(&m->search, problem->arena.classes);
    failed |= nav_cells_init(&m->cells);
    failed |= nav_particle_map_init(&m->challenger, problem->arena.classes);
    m->particle = calloc((size_t)m->options.particles, sizeof *m->particle);
    for (int n = 0; m->particle && n < m->options.particles; n++) {
        failed |= nav_particle_map_init(&m->particle[n], problem->arena.classes);
        m->particle[n].scale = mapper_scale(n, m->options.particles);
    }
    return m->particle ? failed : -1;
}

struct nav_mapper *nav_mapper_new(const struct nav_problem *problem, const struct nav_mapper_options *options)
{
    struct nav_mapper *m = calloc(1, sizeof *m);
    if (!m || options->particles < 1 || options->particles > PARTICLES_MOST) {
        free(m);
        return NULL;
    }
    m->problem = problem;
    m->options = *options;
    m->caught_up = -1;
    nav_rng_seed(&m->rng, problem->seed, STREAM);
    if (mapper_init(m)) {
        nav_mapper_free(m);
        return NULL;
    }
    return m;
}

void nav_mapper_free(struct nav_mapper *m)
{
    if (!m)
        return;
    for (int n = 0; m->particle && n < m->options.particles; n++)
        nav_particle_map_free(&m->particle[n]);
    free(m->particle);
    nav_particle_map_free(&m->challenger);
    nav_trail_free(&m->trail);
    nav_trail_free(&m->challenger_trail);
    nav_lattice_search_free(&m->search);
    nav_cells_free(&m->cells);
    nav_record_free(&m->record);
    free(m);
}

struct nav_particle_map *nav_mapper_best(const struct nav_mapper *m)
{
    struct nav_particle_map *best = &m->particle[0];
    for (int n = 1; n < m->options.particles; n++)
        best = m->particle[n].evidence > best->evidence ? &m->particle[n] : best;
    return best;
}

static void mapper_follow(const struct nav_mapper *m, struct nav_trail *trail, const struct nav_particle_map *p,
                          const struct nav_record_row *row)
{
    struct nav_pose pose = nav_particle_map_pose(p);
    bool any = false;
    nav_trail_move(trail, row->step);
    for (int tip = 0; tip < m->record.tips; tip++) {
        const float *window = row->window + (ptrdiff_t)tip * (1 + m->record.classes);
        if (!(window[0] >= 0.0F))
            continue;
        nav_trail_add(trail, &pose, tip, (double)window[0], window + 1);
        any = true;
    }
    if (any)
        nav_trail_row_done(trail);
}

static void mapper_mark(struct nav_mapper *m, const struct nav_record_row *row)
{
    const struct nav_particle_map *best = nav_mapper_best(m);
    const double *cov = best->joint.cov;
    double variance = (cov[NAV_JOINT_X] + cov[NAV_JOINT_Y * (best->joint.room + 1)]) / 2.0;
    nav_cells_take(&m->cells, &m->record, row, nav_particle_map_pose(best), sqrt(fmax(variance, 0.0)));
}

/* Hypotheses that the rows speak against go on from the best one, each with its own trust in the odometry. */
static void mapper_resample(struct nav_mapper *m)
{
    const struct nav_particle_map *best = nav_mapper_best(m);
    for (int n = 0; n < m->options.particles; n++) {
        if (m->particle[n].evidence < best->evidence - BEHIND)
            nav_particle_map_copy(&m->particle[n], best);
    }
}

/* Looks for a lattice when there are enough new borders, and begins to try it on all rows. */
static void mapper_challenge(struct nav_mapper *m)
{
    const struct nav_particle_map *best = nav_mapper_best(m);
    const struct nav_joint *j = &best->joint;
    struct nav_lattice found;
    bool due = m->trail.borders > GROWN * m->sought,
         known = j->cov[NAV_JOINT_AXES * (j->room + 1)] < NAV_MAPPER_AXES_KNOWN;
    if (m->caught_up >= 0 || !due || !m->options.lattice || !nav_record_whole(&m->record))
        return;
    m->sought = m->trail.borders;
    if (!nav_lattice_find(&m->search, &m->trail, known ? j->mean[NAV_JOINT_AXES] : 0.0, &found))
        return;
    m->challenger.scale = best->scale;
    nav_particle_map_begin(&m->challenger);
    double off = known ? remainder(found.turn - j->mean[NAV_JOINT_AXES], NAV_PI / 2.0) : 0.0;
    nav_floor_adopt(&m->challenger.floor, &m->challenger.joint, &found, fabs(off) < RIGHT_MOST);
    nav_trail_clear(&m->challenger_trail);
    m->caught_up = 0;
}

static void mapper_take_over(struct nav_mapper *m)
{
    struct nav_trail trail = m->trail;
    m->trail = m->challenger_trail;
    m->challenger_trail = trail;
    for (int n = 0; n < m->options.particles; n++)
        nav_particle_map_copy(&m->particle[n], &m->challenger);
}

/* The challenger takes some more rows; when it has taken all, it is compared. Without a lattice textures are explained
 * by patches. */
static void mapper_catch_up(struct nav_mapper *m)
{
    if (m->caught_up < 0)
        return;
    for (int n = 0; n < CATCH_UP && m->caught_up < m->record.rows; n++) {
        struct nav_record_row row = nav_record_at(&m->record, m->caught_up++);
        nav_particle_map_take(&m->challenger, &m->record, &row, NULL);
        mapper_follow(m, &m->challenger_trail, &m->challenger, &row);
    }
    if (m->caught_up < m->record.rows)
        return;
    m->caught_up = -1;
    const struct nav_particle_map *best = nav_mapper_best(m);
    if (m->challenger.evidence >
        best->evidence + (best->floor.known ? 0.0 : nav_trail_patches(&m->trail, true)) + MARGIN)
        mapper_take_over(m);
}

/* Gives a lattice up that patches of any shape explain the windows better than. */
static void mapper_refuse(struct nav_mapper *m)
{
    const struct nav_floor *floor = &nav_mapper_best(m)->floor;
    if (!floor->known || floor->evidence > nav_trail_patches(&m->trail, true) - REFUSED)
        return;
    for (int n = 0; n < m->options.particles; n++)
        m->particle[n].floor.known = false;
}

/* Mean and covariance of the particles' mixture. */
static void mapper_estimate(const struct nav_mapper *m, struct nav_estimate *out)
{
    const struct nav_particle_map *best = nav_mapper_best(m);
    const double *centre = best->joint.mean;
    double total = 0.0, mean[3] = {0.0}, square[9] = {0.0};
    for (int n = 0; n < m->options.particles; n++) {
        const struct nav_joint *j = &m->particle[n].joint;
        double weight = exp(m->particle[n].evidence - best->evidence), off[3];
        total += weight;
        for (int r = 0; r < 3; r++) {
            off[r] = r < 2 ? j->mean[r] - centre[r] : nav_wrap(j->mean[r] - centre[r]);
            mean[r] += weight * off[r];
        }
        for (int r = 0; r < 9; r++)
            square[r] += weight * (j->cov[r / 3 * j->room + r % 3] + off[r / 3] * off[r % 3]);
    }
    for (int r = 0; r < 9; r++)
        out->covariance[r] = square[r] / total - mean[r / 3] * mean[r % 3] / (total * total);
    out->pose = (struct nav_pose){centre[0] + mean[0] / total, centre[1] + mean[1] / total,
                                  nav_wrap(centre[2] + mean[2] / total)};
}

static void mapper_answer(const struct nav_mapper *m, struct nav_estimate *out)
{
    *out = (struct nav_estimate){.states = m->options.particles, .touched = m->options.particles};
    mapper_estimate(m, out);
    double place = fmax((out->covariance[0] + out->covariance[4]) / 2.0, 1e-12), turn = fmax(out->covariance[8], 1e-12);
    out->confidence = (1.0 - exp(-0.5 * NAV_NEAR_M * NAV_NEAR_M / place)) * erf(NAV_NEAR_RAD / sqrt(2.0 * turn));
    out->evaluations = m->options.particles + (m->caught_up >= 0 ? CATCH_UP : 0);
    out->bytes =
        (size_t)(m->options.particles + 1) * nav_particle_map_bytes(m->record.classes) + nav_record_bytes(&m->record);
}

void nav_mapper_step(struct nav_mapper *m, const struct nav_row *row, struct nav_estimate *out)
{
    struct nav_record_row taken = nav_record_at(&m->record, nav_record_take(&m->record, row));
    for (int n = 0; n < m->options.particles; n++)
        nav_particle_map_take(&m->particle[n], &m->record, &taken, n < SCALES ? NULL : &m->rng);
    mapper_follow(m, &m->trail, nav_mapper_best(m), &taken);
    mapper_mark(m, &taken);
    mapper_resample(m);
    mapper_challenge(m);
    mapper_catch_up(m);
    mapper_refuse(m);
    mapper_answer(m, out);
}

static double mapper_now_us(void)
{
    struct timespec t = {0, 0};
    (void)clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return (double)t.tv_sec * 1e6 + (double)t.tv_nsec * 1e-3;
}

void nav_mapper_replay(struct nav_mapper *m, const struct nav_rows *rows, long first, long count,
                       struct nav_estimate *out, double *step_us)
{
    for (long k = 0; k < count; k++) {
        struct nav_row row = nav_rows_at(rows, first + k);
        double begun = mapper_now_us();
        nav_mapper_step(m, &row, &out[k]);
        step_us[k] = mapper_now_us() - begun;
    }
}

uint64_t nav_mapper_bad_cells(const struct nav_mapper *m)
{
    return m->record.intake.bad_cells;
}

uint64_t nav_mapper_bad_rows(const struct nav_mapper *m)
{
    return m->record.intake.bad_rows;
}
