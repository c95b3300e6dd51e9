#include "meeting.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double TOGETHER_M = 0.08; /* windows so near are one patch */
static const double MAP_WRONG = 0.05;  /* share of patches and faces that are otherwise than mapped */
static const double DRIFT_M = 0.03;    /* of either map over its extent, and of borders */
static const double DRIFT_RAD = 0.03;
static const double FREE = -2.0;                       /* log-odds of a cell that is free */
static const double AGAINST = 1.2, AGAINST_MOST = 5.0; /* nats a point of a face where the other map is free; a face */
static const double POINT_M = 0.05;                    /* between such points */
static const double BEHIND_M = 0.0125;                 /* from a face to what is solid */
static const double NEARLY = 0.6;                      /* of the best place's score */
static const double PRIOR_MET = 0.5;                   /* that the maps meet at all */
static const double APART_M = 0.2, APART_RAD = 0.3;    /* places that are not one */
static const double STEP_M = 0.125, STEP_RAD = 0.15;   /* of the search, where directions are not known */
static const double REACH_M = 0.5;                     /* that a map may begin beyond what the other knows */
static const double AXES_KNOWN = 1.0;                  /* rad^2 */
/* Standard deviations of a place that the search ends at: what its mass is. */
static const double PEAK_M = 0.02, PEAK_RAD = 0.02;

enum { COARSE = 48, REFINED = 12 }; /* patches weighed in the search; places that it goes on from */

int nav_meeting_init(struct nav_meeting *m, int classes)
{
    m->classes = classes;
    m->tile = calloc((size_t)NAV_FLOOR_SIDE * NAV_FLOOR_SIDE * (size_t)classes, sizeof *m->tile);
    m->ratio = calloc(NAV_MEETING_PATCHES * (size_t)classes, sizeof *m->ratio);
    return m->tile && m->ratio ? 0 : -1;
}

void nav_meeting_free(struct nav_meeting *m)
{
    free(m->tile);
    free(m->ratio);
}

static void meeting_tiles(struct nav_meeting *m, const struct nav_floor *f)
{
    for (int tile = 0; tile < NAV_FLOOR_SIDE * NAV_FLOOR_SIDE; tile++) {
        const float *loglik = f->tile + (ptrdiff_t)tile * m->classes;
        double *out = m->tile + (ptrdiff_t)tile * m->classes, best = -INFINITY, total = 0.0;
        bool read = false;
        for (int k = 0; k < m->classes; k++) {
            read = read || loglik[k] != 0.0F;
            best = fmax(best, (double)loglik[k]);
        }
        for (int k = 0; k < m->classes; k++)
            total += out[k] = exp((double)loglik[k] - best);
        for (int k = 0; k < m->classes; k++)
            out[k] = read ? out[k] / total : -1.0;
    }
}

static void meeting_close(struct nav_meeting *m, int at, double *loglik, int count)
{
    struct nav_meeting_patch *p = &m->patch[at];
    float *ratio = m->ratio + (ptrdiff_t)at * m->classes;
    p->x /= count;
    p->y /= count;
    p->greatest = -INFINITY;
    for (int k = 0; k < m->classes; k++)
        p->greatest = fmax(p->greatest, loglik[k]);
    for (int k = 0; k < m->classes; k++)
        ratio[k] = (float)exp(loglik[k] - p->greatest);
}

/* Makes patches of the last windows of a trail, as many as there is room for. */
static void meeting_patches(struct nav_meeting *m, const struct nav_trail *t)
{
    double loglik[256];
    m->patches = 0;
    for (int tip = 0; tip < t->tips; tip++) {
        int count = 0, first = m->patches, most = NAV_MEETING_PATCHES * (tip + 1) / t->tips;
        struct nav_trail_point begun = {0.0, 0.0};
        for (int n = t->count - 1; n >= 0 && m->patches < most; n--) {
            if (t->tip[n] != tip)
                continue;
            if (count && hypot(t->point[n].x - begun.x, t->point[n].y - begun.y) > TOGETHER_M) {
                meeting_close(m, m->patches++, loglik, count);
                count = 0;
                if (m->patches == most)
                    break;
            }
            struct nav_meeting_patch *p = &m->patch[m->patches];
            if (!count) {
                *p = (struct nav_meeting_patch){.x = 0.0};
                begun = t->point[n];
                memset(loglik, 0, (size_t)m->classes * sizeof *loglik);
            }
            p->x += t->point[n].x;
            p->y += t->point[n].y;
            p->fresh += (double)t->fresh[n];
            for (int k = 0; k < m->classes; k++)
                loglik[k] += (double)t->weight[(ptrdiff_t)n * m->classes + k];
            count++;
        }
        if (count && m->patches < most && m->patches >= first)
            meeting_close(m, m->patches++, loglik, count);
    }
}

static int meeting_stretches(const struct nav_particle_map *p, struct nav_meeting_stretch *out)
{
    int count = 0;
    for (int n = 0; n < p->faces.count; n++) {
        const struct nav_face *g = &p->faces.face[n];
        const double *mean = p->joint.mean, *cov = p->joint.cov;
        double low, high, normal = mean[g->index], nx = cos(normal), ny = sin(normal), offset = mean[g->index + 1];
        for (int cell = nav_face_stretch(g, 0, &low, &high); cell > 0; cell = nav_face_stretch(g, cell, &low, &high)) {
            if (count == NAV_MEETING_STRETCHES)
                return count;
            double middle = (low + high) / 2.0;
            out[count++] =
                (struct nav_meeting_stretch){.x = g->anchor_x + nx * offset - ny * middle,
                                             .y = g->anchor_y + ny * offset + nx * middle,
                                             .nx = nx,
                                             .ny = ny,
                                             .normal = normal,
                                             .half = (high - low) / 2.0,
                                             .variance = DRIFT_M * DRIFT_M,
                                             .turn_var = cov[g->index * (p->joint.room + 1)] + DRIFT_RAD * DRIFT_RAD};
        }
    }
    return count;
}

/* What a place is weighed by. */
struct meeting_case {
    struct nav_meeting *m;
    const struct nav_kept *older;
    const struct nav_cells *younger;
    double extent; /* m of the older map */
    double blur;   /* m */
    int every;     /* patch that is weighed, for all of them: 1 */
};

static const double *meeting_tile(const struct nav_meeting *m, int column, int row)
{
    int c = column + NAV_FLOOR_SIDE / 2, r = row + NAV_FLOOR_SIDE / 2;
    if (c < 0 || r < 0 || c >= NAV_FLOOR_SIDE || r >= NAV_FLOOR_SIDE)
        return NULL;
    const double *tile = m->tile + (ptrdiff_t)(r * NAV_FLOOR_SIDE + c) * m->classes;
    return tile[0] < 0.0 ? NULL : tile;
}

static double meeting_ratio(const struct nav_meeting *m, const double *tile, const float *ratio, double fresh)
{
    double sum = 0.0;
    if (!tile)
        return fresh;
    for (int k = 0; k < m->classes; k++)
        sum += tile[k] * (double)ratio[k];
    return sum;
}

static double meeting_floor(const struct meeting_case *c, struct nav_pose at)
{
    const struct nav_meeting *m = c->m;
    const struct nav_floor *f = &c->older->map.floor;
    const double *mean = c->older->map.joint.mean;
    double turn = mean[NAV_JOINT_LATTICE_TURN], pitch = mean[NAV_JOINT_PITCH], sum = 0.0;
    if (!f->known)
        return 0.0;
    /* The younger frame in the lattice's, in tiles. */
    double lc = cos(turn), ls = sin(turn), dx = at.x - f->x, dy = at.y - f->y;
    double u0 = (lc * dx + ls * dy - mean[NAV_JOINT_LATTICE_U]) / pitch;
    double v0 = (lc * dy - ls * dx - mean[NAV_JOINT_LATTICE_V]) / pitch;
    double cosine = cos(at.theta - turn) / pitch, sine = sin(at.theta - turn) / pitch, blur = c->blur / pitch;
    for (int n = 0; n < m->patches; n += c->every) {
        const struct nav_meeting_patch *p = &m->patch[n];
        const float *ratio = m->ratio + (ptrdiff_t)n * m->classes;
        double u = u0 + cosine * p->x - sine * p->y, v = v0 + sine * p->x + cosine * p->y;
        double off_u = u - round(u), off_v = v - round(v);
        bool first = fabs(off_u) < fabs(off_v);
        double off = first ? off_u : off_v, beyond = fmax(0.5 - fabs(off) / (4.0 * blur), 0.0);
        int column = (int)floor(u), row = (int)floor(v), step = off < 0.0 ? 1 : -1;
        double fresh = exp(p->fresh - p->greatest);
        double here = meeting_ratio(m, meeting_tile(m, column, row), ratio, fresh);
        if (beyond > 0.0) {
            const double *across = meeting_tile(m, column + (first ? step : 0), row + (first ? 0 : step));
            here += beyond * (meeting_ratio(m, across, ratio, fresh) - here);
        }
        sum += log((1.0 - MAP_WRONG) * here / fresh + MAP_WRONG);
    }
    return sum * c->every;
}

/* Nats against a stretch for its points that lie where another map is free; known: points of which that map knows. */
static double meeting_against(const struct nav_meeting_stretch *s, struct nav_pose at, const struct nav_cells *other,
                              int *known)
{
    double c = cos(at.theta), sn = sin(at.theta), sum = 0.0;
    int points = (int)(2.0 * s->half / POINT_M) + 1;
    for (int n = 0; n < points; n++) {
        double along = ((n + 0.5) / points * 2.0 - 1.0) * s->half;
        double x = s->x - s->ny * along - BEHIND_M * s->nx, y = s->y + s->nx * along - BEHIND_M * s->ny;
        /* A little deeper than both maps may be off. */
        double deep = 2.0 * DRIFT_M;
        bool here = nav_cells_odds(other, at.x + c * x - sn * y, at.y + sn * x + c * y) != 0.0;
        x -= deep * s->nx;
        y -= deep * s->ny;
        double odds = nav_cells_odds(other, at.x + c * x - sn * y, at.y + sn * x + c * y);
        *known += here || odds != 0.0;
        sum += odds < FREE ? AGAINST : 0.0;
    }
    return fmin(sum, AGAINST_MOST);
}

/* Log-likelihood of a stretch as one of the older map's faces or a new one, over one anywhere. */
static double meeting_face(const struct meeting_case *c, const struct nav_meeting_stretch *s, struct nav_pose at)
{
    const struct nav_meeting *m = c->m;
    double cosine = cos(at.theta), sine = sin(at.theta), x = at.x + cosine * s->x - sine * s->y;
    double y = at.y + sine * s->x + cosine * s->y, sum = 0.0, alike = 0.0;
    int known = 0;
    double against = meeting_against(s, at, &c->older->course.cells, &known);
    if (!known)
        return 0.0;
    for (int n = 0; n < m->olders; n++) {
        const struct nav_meeting_stretch *g = &m->older[n];
        double turn = nav_wrap(s->normal + at.theta - g->normal), dx = x - g->x, dy = y - g->y;
        double turn_var = s->turn_var + g->turn_var, off = g->nx * dx + g->ny * dy, along = g->nx * dy - g->ny * dx;
        if (turn * turn > 9.0 * turn_var)
            continue;
        double gap = fmax(fabs(along) - g->half - s->half, 0.0), variance = s->variance + g->variance;
        alike += 1.0;
        sum += exp(-0.5 * (off * off / variance + turn * turn / turn_var) - gap / 0.1) / sqrt(2.0 * NAV_PI * variance);
    }
    double met = alike > 0.0 ? sum / alike * c->extent : 0.0;
    return log((1.0 - MAP_WRONG) * (0.7 * met + 0.3) + MAP_WRONG) - against;
}

static double meeting_score(const struct meeting_case *c, struct nav_pose at)
{
    const struct nav_meeting *m = c->m;
    double sum = meeting_floor(c, at);
    struct nav_pose back = nav_compose((struct nav_pose){0.0, 0.0, -at.theta}, (struct nav_pose){-at.x, -at.y, 0.0});
    int known = 0;
    for (int n = 0; n < m->youngers; n++)
        sum += meeting_face(c, &m->younger[n], at);
    for (int n = 0; n < m->olders; n++)
        sum -= meeting_against(&m->older[n], back, c->younger, &known);
    return sum;
}

static bool meeting_near(struct nav_pose a, struct nav_pose b)
{
    return hypot(a.x - b.x, a.y - b.y) < APART_M && fabs(nav_wrap(a.theta - b.theta)) < APART_RAD;
}

/* Keeps a place among the best that are apart from each other. */
static void meeting_keep(struct nav_meeting *m, struct nav_pose at, double score)
{
    int same = 0, last;
    while (same < m->places && !meeting_near(m->place[same].at, at))
        same++;
    if (same < m->places && m->place[same].score >= score)
        return;
    if (same == m->places && m->places == NAV_MEETING_PLACES && m->place[--same].score >= score)
        return;
    last = same < m->places ? same : m->places++;
    for (; last > 0 && m->place[last - 1].score < score; last--)
        m->place[last] = m->place[last - 1];
    m->place[last] = (struct nav_meeting_place){at, score};
}

/* Steps toward higher scores, finer and finer. */
static void meeting_refine(const struct meeting_case *c, struct nav_meeting_place *p)
{
    double step = STEP_M / 2.0, turn = STEP_RAD / 2.0;
    for (int round = 0; round < 4; round++, step /= 2.0, turn /= 2.0) {
        for (int tries = 0; tries < 4; tries++) {
            struct nav_meeting_place best = *p;
            for (int axis = 0; axis < 6; axis++) {
                struct nav_pose at = p->at;
                double sign = axis % 2 ? -1.0 : 1.0;
                at.x += axis / 2 == 0 ? sign * step : 0.0;
                at.y += axis / 2 == 1 ? sign * step : 0.0;
                at.theta = nav_wrap(at.theta + (axis / 2 == 2 ? sign * turn : 0.0));
                double score = meeting_score(c, at);
                if (score > best.score)
                    best = (struct nav_meeting_place){at, score};
            }
            if (best.score <= p->score)
                break;
            *p = best;
        }
    }
}

/* All positions of the younger origin within reach of the older map, at one direction. */
static void meeting_scan(const struct meeting_case *c, double theta, double reach)
{
    const struct nav_cells *k = &c->older->course.cells;
    double low[2], high[2];
    for (int axis = 0; axis < 2; axis++) {
        low[axis] = (k->from[axis] - NAV_CELLS_SIDE / 2) * NAV_CELLS_M - reach;
        high[axis] = (k->until[axis] - NAV_CELLS_SIDE / 2) * NAV_CELLS_M + reach;
    }
    for (double x = low[0]; x <= high[0]; x += STEP_M) {
        for (double y = low[1]; y <= high[1]; y += STEP_M) {
            struct nav_pose at = {x, y, theta};
            double score = meeting_score(c, at);
            if (score > 0.0)
                meeting_keep(c->m, at, score);
        }
    }
}

static bool meeting_axes(const struct nav_joint *j)
{
    return j->cov[NAV_JOINT_AXES * (j->room + 1)] < AXES_KNOWN;
}

/* Directions: those that bring right angles onto right angles, or all. */
static void meeting_scan_all(const struct meeting_case *c, const struct nav_joint *younger)
{
    const struct nav_joint *older = &c->older->map.joint;
    bool known = meeting_axes(older) && meeting_axes(younger);
    int count = known ? 4 : (int)ceil(2.0 * NAV_PI / STEP_RAD);
    double base = known ? older->mean[NAV_JOINT_AXES] - younger->mean[NAV_JOINT_AXES] : 0.0;
    for (int n = 0; n < count; n++)
        meeting_scan(c, nav_wrap(base + 2.0 * NAV_PI * n / count), REACH_M);
}

double nav_meeting_find(struct nav_meeting *m, const struct nav_kept *older, const struct nav_particle_map *map,
                        const struct nav_course *course)
{
    const struct nav_cells *k = &older->course.cells;
    struct meeting_case c = {.m = m, .older = older, .younger = &course->cells, .blur = 2.0 * DRIFT_M};
    /* Places that were good the last time are looked at again. */
    struct nav_meeting_place from[NAV_MEETING_KNOWN];
    int froms = m->places < NAV_MEETING_KNOWN ? m->places : NAV_MEETING_KNOWN;
    memcpy(from, m->place, (size_t)froms * sizeof *from);
    m->places = 0;
    if (k->from[0] >= k->until[0])
        return 0.0;
    double wide = (k->until[0] - k->from[0]) * NAV_CELLS_M, high = (k->until[1] - k->from[1]) * NAV_CELLS_M;
    c.extent = sqrt(wide * high);
    if (older->map.floor.known)
        meeting_tiles(m, &older->map.floor);
    meeting_patches(m, &course->trail);
    m->olders = meeting_stretches(&older->map, m->older);
    m->youngers = meeting_stretches(map, m->younger);
    c.every = 1 + m->patches / COARSE;
    meeting_scan_all(&c, &map->joint);
    c.blur = DRIFT_M;
    c.every = 1;
    struct nav_meeting_place rough[NAV_MEETING_PLACES + NAV_MEETING_KNOWN];
    int found = m->places < REFINED ? m->places : REFINED;
    memcpy(rough, m->place, (size_t)found * sizeof *rough);
    memcpy(rough + found, from, (size_t)froms * sizeof *rough);
    found += froms;
    m->places = 0;
    for (int n = 0; n < found; n++) {
        rough[n].score = meeting_score(&c, rough[n].at);
        meeting_refine(&c, &rough[n]);
        meeting_keep(m, rough[n].at, rough[n].score);
    }
    if (!m->places)
        return 0.0;
    double volume = pow(2.0 * NAV_PI, 1.5) * PEAK_M * PEAK_M * PEAK_RAD / (wide * high * 2.0 * NAV_PI);
    double mass = 0.0, best = m->place[0].score;
    for (int n = 0; n < m->places; n++)
        mass += exp(m->place[n].score - best);
    /* Sums over many readings are surer than they should be: what explains nearly as much is not excluded. */
    if (m->places > 1 && m->place[1].score > NEARLY * best)
        return 0.5;
    double never = (1.0 - PRIOR_MET) / PRIOR_MET / volume * exp(-best);
    return 1.0 / (mass + never);
}
