#include "face.h"

#include <math.h>

static const double FACING_LEAST = 0.15; /* cosine between whisker and normal */
static const double FAR_M = 0.5;
static const double REACH_RIGHT = 0.4,
                    REACH_FREE = 0.08; /* m in which a face is found to go on, at right angles and not */
static const double CELL_M = 0.05;
/* Two faces are one: spread of their offset and direction, standard deviations they may differ by, odds, angle looked
 * at. */
static const double SAME_M = 0.004, SAME_RAD = 0.01, SAME = 2.5, SAME_ODDS = 3.0, TURN_MOST = 0.35;

bool nav_face_look(const struct nav_face *g, const struct nav_joint *j, const struct nav_touch *t,
                   struct nav_face_view *v)
{
    const double *m = j->mean;
    double c = cos(m[NAV_JOINT_HEADING]), s = sin(m[NAV_JOINT_HEADING]);
    double lx = c * t->x - s * t->y, ly = s * t->x + c * t->y;
    double ux = c * t->along_x - s * t->along_y, uy = s * t->along_x + c * t->along_y;
    double dx = m[NAV_JOINT_X] + lx - g->anchor_x, dy = m[NAV_JOINT_Y] + ly - g->anchor_y;
    double nx = cos(m[g->index]), ny = sin(m[g->index]);
    v->off = nx * dx + ny * dy - m[g->index + 1];
    v->along = nx * dy - ny * dx;
    v->facing = -(nx * ux + ny * uy);
    v->slant = nx * uy - ny * ux;
    if (!(fabs(v->off) < FAR_M) || v->facing < FACING_LEAST)
        return false;
    v->form.terms = 0;
    nav_linear_add(&v->form, NAV_JOINT_X, nx);
    nav_linear_add(&v->form, NAV_JOINT_Y, ny);
    nav_linear_add(&v->form, NAV_JOINT_HEADING, ny * lx - nx * ly);
    nav_linear_add(&v->form, g->index, v->along);
    nav_linear_add(&v->form, g->index + 1, -1.0);
    v->variance = nav_joint_variance(j, &v->form);
    return true;
}

double nav_face_noise(const struct nav_face_view *v, double sigma)
{
    return sigma * sigma * v->facing * v->facing + NAV_FACE_ROUGH_M * NAV_FACE_ROUGH_M;
}

double nav_face_normal_density(double off, double variance)
{
    return exp(-0.5 * off * off / variance) / sqrt(2.0 * NAV_PI * variance);
}

double nav_face_decay(const struct nav_face *g)
{
    return 1.0 / (g->right ? REACH_RIGHT : REACH_FREE);
}

double nav_face_likelihood(const struct nav_face *g, const struct nav_face_view *v, double noise)
{
    double total = v->variance + noise;
    if (v->off * v->off > NAV_FACE_GATE * total)
        return 0.0;
    double reach = exp(-nav_face_beyond(g, v->along) * nav_face_decay(g));
    return v->facing * reach * nav_face_normal_density(v->off, total);
}

static int face_cell(double along)
{
    int cell = (int)floor(along / CELL_M) + NAV_FACE_CELLS / 2;
    return cell < 0 ? 0 : cell > NAV_FACE_CELLS - 1 ? NAV_FACE_CELLS - 1 : cell;
}

static bool face_has(const struct nav_face *g, int cell)
{
    return (g->felt[cell / 64] >> cell % 64 & 1) != 0;
}

void nav_face_feel(struct nav_face *g, double low, double high)
{
    g->low = fmin(g->low, low);
    g->high = fmax(g->high, high);
    for (int cell = face_cell(low); cell <= face_cell(high); cell++)
        g->felt[cell / 64] |= 1ULL << cell % 64;
}

bool nav_face_felt(const struct nav_face *g, double along, double within)
{
    if (along < g->low + within || along > g->high - within)
        return false;
    for (int cell = face_cell(along - within); cell <= face_cell(along + within); cell++) {
        if (!face_has(g, cell))
            return false;
    }
    return true;
}

int nav_face_stretch(const struct nav_face *g, int from, double *low, double *high)
{
    *low = *high = 0.0;
    while (from < NAV_FACE_CELLS && !face_has(g, from))
        from++;
    if (from == NAV_FACE_CELLS)
        return 0;
    *low = fmax((from - NAV_FACE_CELLS / 2) * CELL_M, g->low);
    while (from < NAV_FACE_CELLS && face_has(g, from))
        from++;
    *high = fmin((from - NAV_FACE_CELLS / 2) * CELL_M, g->high);
    return from;
}

double nav_face_beyond(const struct nav_face *g, double along)
{
    return fmax(fmax(g->low - along, along - g->high), 0.0);
}

/* The younger face's middle as seen from the older one. */
struct face_pair {
    double off, along, middle, turn;
    struct nav_linear place, angle;
};

static void face_compare(const struct nav_face *g, const struct nav_face *h, const struct nav_joint *j,
                         struct face_pair *p)
{
    const double *m = j->mean;
    double nx = cos(m[g->index]), ny = sin(m[g->index]), hx = cos(m[h->index]), hy = sin(m[h->index]);
    p->middle = (h->low + h->high) / 2.0;
    double dx = h->anchor_x + hx * m[h->index + 1] - hy * p->middle - g->anchor_x;
    double dy = h->anchor_y + hy * m[h->index + 1] + hx * p->middle - g->anchor_y;
    p->off = nx * dx + ny * dy - m[g->index + 1];
    p->along = nx * dy - ny * dx;
    p->turn = nav_wrap(m[h->index] - m[g->index]);
    p->place.terms = p->angle.terms = 0;
    nav_linear_add(&p->place, g->index, p->along);
    nav_linear_add(&p->place, g->index + 1, -1.0);
    nav_linear_add(&p->place, h->index, -p->middle);
    nav_linear_add(&p->place, h->index + 1, 1.0);
    nav_linear_add(&p->angle, h->index, 1.0);
    nav_linear_add(&p->angle, g->index, -1.0);
}

static bool face_same(const struct nav_face *g, const struct nav_face *h, const struct nav_joint *j,
                      const struct face_pair *p)
{
    double gap = fmax(nav_face_beyond(g, p->along) - (h->high - h->low) / 2.0, 0.0);
    if (fabs(p->off) > FAR_M || fabs(p->turn) > TURN_MOST)
        return false;
    double v = nav_joint_variance(j, &p->place) + SAME_M * SAME_M;
    double w = nav_joint_variance(j, &p->angle) + SAME_RAD * SAME_RAD;
    double decay = fmax(nav_face_decay(g), nav_face_decay(h));
    double odds = nav_face_normal_density(p->off, v) * exp(-gap * decay) / NAV_FACE_NEW_PER_M;
    return p->off * p->off < SAME * SAME * v && p->turn * p->turn < SAME * SAME * w && odds > SAME_ODDS;
}

bool nav_face_join(struct nav_face *g, const struct nav_face *h, struct nav_joint *j)
{
    struct face_pair p;
    face_compare(g, h, j, &p);
    if (!face_same(g, h, j, &p))
        return false;
    nav_joint_measure(j, &p.place, -p.off, SAME_M * SAME_M);
    nav_joint_measure(j, &p.angle, -nav_wrap(j->mean[h->index] - j->mean[g->index]), SAME_RAD * SAME_RAD);
    for (int cell = 0; cell < NAV_FACE_CELLS; cell++) {
        double at = (cell - (NAV_FACE_CELLS - 1) / 2.0) * CELL_M - p.middle + p.along;
        if (face_has(h, cell))
            nav_face_feel(g, at, at);
    }
    g->hits += h->hits;
    return true;
}
