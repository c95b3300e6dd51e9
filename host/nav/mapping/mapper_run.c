#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "gaussian.h"
#include "mapper_state.h"

static const double BEHIND = 30.0;     /* nats at which a hypothesis is given up */
static const double MARGIN = 3.0;      /* nats by which a new lattice must be better */
static const double GROWN = 1.25;      /* of the borders, since a lattice was sought last */
static const double REFUSED = 5.0;     /* nats against a lattice at which it is given up */
static const double RIGHT_MOST = 0.15; /* rad between a lattice and faces that stand along it */
enum { CATCH_UP = 60 };

struct nav_mapper_options nav_mapper_default(void)
{
    return (struct nav_mapper_options){.lattice = true};
}

static int mapper_init(struct nav_mapper *m)
{
    const struct nav_problem *problem = m->problem;
    int failed = nav_record_init(&m->record, problem);
    failed |= nav_course_init(&m->course, problem);
    failed |= nav_lattice_search_init(&m->search, problem->arena.classes);
    failed |= nav_kidnap_init(&m->kidnap, problem);
    failed |= nav_kept_init(&m->challenger, problem);
    for (int n = 0; n < NAV_HYPOTHESES; n++) {
        failed |= nav_particle_map_init(&m->hypothesis[n], problem->arena.classes);
        m->hypothesis[n].scale = nav_hypothesis_scale(n);
    }
    m->lost = (struct nav_mapper_lost){.first = -1, .noticed = -1};
    return failed;
}

struct nav_mapper *nav_mapper_new(const struct nav_problem *problem, const struct nav_mapper_options *options)
{
    struct nav_mapper *m = calloc(1, sizeof *m);
    if (!m)
        return NULL;
    m->problem = problem;
    m->options = *options;
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
    for (int n = 0; n < NAV_HYPOTHESES; n++)
        nav_particle_map_free(&m->hypothesis[n]);
    nav_kept_free(&m->challenger);
    nav_course_free(&m->course);
    nav_lattice_search_free(&m->search);
    nav_kidnap_free(&m->kidnap);
    nav_record_free(&m->record);
    free(m);
}

const struct nav_particle_map *nav_mapper_best(const struct nav_mapper *m)
{
    const struct nav_particle_map *best = &m->hypothesis[0];
    for (int n = 1; n < NAV_HYPOTHESES; n++)
        best = m->hypothesis[n].evidence > best->evidence ? &m->hypothesis[n] : best;
    return best;
}

/* Goes on from this hypothesis and its course; the course that was in use is left in its place. */
static void mapper_adopt(struct nav_mapper *m, struct nav_kept *kept)
{
    struct nav_course course = m->course;
    m->course = kept->course;
    kept->course = course;
    for (int n = 0; n < NAV_HYPOTHESES; n++)
        nav_particle_map_copy(&m->hypothesis[n], &kept->map);
    m->challenged = false;
}

/* Hypotheses that the rows speak against go on from the best one, each with its own trust in the odometry. */
static void mapper_resample(struct nav_mapper *m)
{
    const struct nav_particle_map *best = nav_mapper_best(m);
    for (int n = 0; n < NAV_HYPOTHESES; n++) {
        if (m->hypothesis[n].evidence < best->evidence - BEHIND)
            nav_particle_map_copy(&m->hypothesis[n], best);
    }
}

/* Looks for a lattice when there are enough new borders, and begins to try it on all rows. */
static void mapper_challenge(struct nav_mapper *m)
{
    const struct nav_particle_map *best = nav_mapper_best(m);
    const struct nav_joint *j = &best->joint;
    struct nav_lattice found;
    bool due = m->course.trail.borders > GROWN * m->sought,
         known = j->cov[NAV_JOINT_AXES * (j->room + 1)] < NAV_JOINT_AXES_KNOWN;
    if (m->challenged || !due || !m->options.lattice || m->course.entered || !nav_record_whole(&m->record))
        return;
    m->sought = m->course.trail.borders;
    if (!nav_lattice_find(&m->search, &m->course.trail, known ? j->mean[NAV_JOINT_AXES] : 0.0, &found))
        return;
    m->challenger.map.scale = best->scale;
    nav_kept_begin(&m->challenger, 0);
    double off = known ? remainder(found.turn - j->mean[NAV_JOINT_AXES], NAV_PI / 2.0) : 0.0;
    nav_floor_adopt(&m->challenger.map.floor, &m->challenger.map.joint, &found, fabs(off) < RIGHT_MOST);
    m->challenged = true;
}

/* The challenger takes some more rows; when it has taken all, it is compared. */
static void mapper_catch_up(struct nav_mapper *m)
{
    struct nav_kept *c = &m->challenger;
    if (!m->challenged)
        return;
    for (int n = 0; n < CATCH_UP && c->course.row < m->course.row; n++)
        nav_kept_take(c, &m->record);
    if (c->course.row < m->course.row)
        return;
    m->challenged = false;
    if (nav_course_evidence(&c->course, &c->map) >= nav_course_evidence(&m->course, nav_mapper_best(m)) + MARGIN)
        mapper_adopt(m, c);
}

/* Gives a lattice up that patches of any shape explain the windows better than. */
static void mapper_refuse(struct nav_mapper *m)
{
    const struct nav_floor *floor = &nav_mapper_best(m)->floor;
    if (!floor->known || floor->evidence > nav_trail_patches(&m->course.trail, true) - REFUSED)
        return;
    for (int n = 0; n < NAV_HYPOTHESES; n++)
        m->hypothesis[n].floor.known = false;
}

/* Mean and covariance of the hypotheses' mixture. */
static void mapper_estimate(const struct nav_mapper *m, struct nav_estimate *out)
{
    const struct nav_particle_map *best = nav_mapper_best(m);
    struct nav_gaussian_sum sum = {.about = nav_particle_map_pose(best)};
    for (int n = 0; n < NAV_HYPOTHESES; n++) {
        const struct nav_joint *j = &m->hypothesis[n].joint;
        struct nav_gaussian g = {.mean = nav_particle_map_pose(&m->hypothesis[n])};
        for (int r = 0; r < 9; r++)
            g.covariance[r] = j->cov[r / 3 * j->room + r % 3];
        nav_gaussian_sum_add(&sum, exp(m->hypothesis[n].evidence - best->evidence), &g);
    }
    struct nav_gaussian all = nav_gaussian_sum_moments(&sum);
    nav_gaussian_estimate(&all, out);
}

static void mapper_answer(const struct nav_mapper *m, struct nav_estimate *out)
{
    *out = (struct nav_estimate){.states = NAV_HYPOTHESES, .touched = NAV_HYPOTHESES};
    mapper_estimate(m, out);
    if (m->lost.first >= 0)
        out->confidence = 0.0;
    out->evaluations = NAV_HYPOTHESES + (m->challenged ? CATCH_UP : 0);
    out->bytes = NAV_HYPOTHESES * nav_particle_map_bytes(m->record.classes) + nav_record_bytes(&m->record) +
                 nav_kidnap_bytes(&m->record);
}

/* Takes a row into the map; by how much its likelihood grew. */
static struct nav_gained mapper_take(struct nav_mapper *m, const struct nav_record_row *row)
{
    const struct nav_particle_map *best = nav_mapper_best(m);
    double evidence = best->evidence, floor = best->floor.evidence, patches = nav_trail_patches(&m->course.trail, true);
    for (int n = 0; n < NAV_HYPOTHESES; n++)
        nav_particle_map_take(&m->hypothesis[n], &m->record, row);
    best = nav_mapper_best(m);
    nav_course_follow(&m->course, best, &m->record, row);
    patches = nav_trail_patches(&m->course.trail, true) - patches;
    floor = best->floor.known ? best->floor.evidence - floor : 0.0;
    return (struct nav_gained){.contacts = best->evidence - evidence - floor,
                               .windows = best->floor.known ? floor : patches,
                               .patches = patches};
}

/* Looks whether the robot was carried off: then the map is that of before, and no more rows are of it. */
static void mapper_watch(struct nav_mapper *m, const struct nav_record_row *row, const struct nav_gained *gained)
{
    struct nav_kidnap_view view = {&m->record, nav_mapper_best(m), &m->course};
    enum nav_kidnap_verdict verdict = nav_kidnap_take(&m->kidnap, &view, row, gained);
    if (verdict == NAV_KIDNAP_CARRIED) {
        mapper_adopt(m, &m->kidnap.calm);
        m->lost = (struct nav_mapper_lost){.first = m->course.row, .noticed = row->number};
    } else if (verdict == NAV_KIDNAP_MENDED) {
        mapper_adopt(m, &m->kidnap.tried);
        view.map = nav_mapper_best(m);
        nav_kidnap_begin(&m->kidnap, &view);
        m->sought = m->course.trail.borders;
    }
}

static void mapper_go_on(struct nav_mapper *m, const struct nav_row *row)
{
    struct nav_record_row taken = nav_record_at(&m->record, nav_record_take(&m->record, row));
    struct nav_gained gained = mapper_take(m, &taken);
    mapper_watch(m, &taken, &gained);
    if (m->lost.first >= 0)
        return;
    mapper_resample(m);
    mapper_challenge(m);
    mapper_catch_up(m);
    mapper_refuse(m);
}

void nav_mapper_step(struct nav_mapper *m, const struct nav_row *row, struct nav_estimate *out)
{
    const bool carried = nav_row_carried(row);
    if (m->lost.first < 0 && carried && m->begun)
        m->lost = (struct nav_mapper_lost){.first = m->course.row, .noticed = m->course.row};
    m->begun |= !carried;
    if (m->lost.first < 0)
        mapper_go_on(m, row);
    mapper_answer(m, out);
}

struct nav_mapper_lost nav_mapper_lost(const struct nav_mapper *m)
{
    return m->lost;
}

static void mapper_step(void *mapper, const struct nav_row *row, struct nav_estimate *out)
{
    nav_mapper_step(mapper, row, out);
}

void nav_mapper_replay(struct nav_mapper *m, const struct nav_rows *rows, long first, long count,
                       struct nav_estimate *out, double *step_us)
{
    nav_replay_steps(mapper_step, m, rows, first, count, out, step_us);
}

uint64_t nav_mapper_bad_cells(const struct nav_mapper *m)
{
    return m->record.intake.bad_cells;
}

uint64_t nav_mapper_bad_rows(const struct nav_mapper *m)
{
    return m->record.intake.bad_rows;
}
