#include "touches.h"

#include <math.h>

static const double VARIANCE_MOST = 4e-4; /* m^2 */
static const double AWAY_MOST = 0.5;      /* m from the contact that a line is sought through */
static const double APART_LEAST = 0.03;   /* m between two contacts that give a direction */
static const double INLIER = 2.5;         /* standard deviations */
static const double STRAIGHT = 2.0;       /* mean squared residual, of what is expected */
static const double ANGLE_MOST = 0.12;    /* rad, standard deviation of a direction that is known */
static const double FACING_LEAST = 0.1;   /* cosine between a whisker and the face's normal */
enum { LEAST = 4 };

static bool touches_has(uint64_t set, int at)
{
    return (set >> at & 1) != 0;
}

void nav_touches_move(struct nav_touches *t, struct nav_pose step, struct nav_noise noise)
{
    double c = cos(step.theta), s = sin(step.theta);
    for (int k = 0; k < NAV_TOUCHES_MOST; k++) {
        if (!touches_has(t->held, k))
            continue;
        struct nav_touch *p = &t->touch[k];
        double dx = p->x - step.x, dy = p->y - step.y, ax = p->along_x, ay = p->along_y;
        p->x = c * dx + s * dy;
        p->y = c * dy - s * dx;
        p->along_x = c * ax + s * ay;
        p->along_y = c * ay - s * ax;
        p->normal -= step.theta;
        p->variance += noise.position + noise.heading * (dx * dx + dy * dy);
        p->turned += noise.heading;
        if (p->variance > VARIANCE_MOST)
            t->held &= ~(1ULL << k);
    }
}

int nav_touches_keep(struct nav_touches *t, struct nav_touch touch)
{
    int at = t->next;
    t->touch[at] = touch;
    t->held |= 1ULL << at;
    t->next = (at + 1) % NAV_TOUCHES_MOST;
    return at;
}

/* Contacts in `among` on the line through two of them; as many as there are, or 0 when the whiskers met it from both
 * sides. */
static uint64_t touches_on(const struct nav_touches *t, uint64_t among, const struct nav_touch *a, double nx, double ny)
{
    uint64_t on = 0;
    for (int k = 0; k < NAV_TOUCHES_MOST; k++) {
        const struct nav_touch *p = &t->touch[k];
        if (!touches_has(among, k))
            continue;
        double dx = p->x - a->x, dy = p->y - a->y, off = nx * dx + ny * dy;
        bool near = dx * dx + dy * dy < AWAY_MOST * AWAY_MOST;
        bool front = -(nx * p->along_x + ny * p->along_y) > FACING_LEAST;
        if (near && front && off * off < INLIER * INLIER * p->variance)
            on |= 1ULL << k;
    }
    return on;
}

int nav_touches_count(uint64_t set)
{
    int n = 0;
    for (; set; set &= set - 1)
        n++;
    return n;
}

/* Weighted sums over the contacts on a line, `along` it and `off` across it from the robot's centre. */
struct touches_sums {
    double weight, along, off, along2, both, off2, low, high, turned;
};

static struct touches_sums touches_sum(const struct nav_touches *t, uint64_t on, double nx, double ny)
{
    struct touches_sums s = {.low = INFINITY, .high = -INFINITY, .turned = INFINITY};
    for (int k = 0; k < NAV_TOUCHES_MOST; k++) {
        if (!touches_has(on, k))
            continue;
        const struct nav_touch *p = &t->touch[k];
        double along = -ny * p->x + nx * p->y, off = nx * p->x + ny * p->y, weight = 1.0 / p->variance;
        s.weight += weight;
        s.along += weight * along;
        s.off += weight * off;
        s.along2 += weight * along * along;
        s.both += weight * along * off;
        s.off2 += weight * off * off;
        s.low = fmin(s.low, along);
        s.high = fmax(s.high, along);
        s.turned = fmin(s.turned, p->turned);
    }
    return s;
}

/* Least squares of `off` by `along`. False: the contacts are in no row, or fix its direction too badly. */
static bool touches_regress(const struct nav_touches *t, uint64_t on, double nx, double ny,
                            struct nav_touches_line *out)
{
    struct touches_sums s = touches_sum(t, on, nx, ny);
    double along = s.along / s.weight, off = s.off / s.weight;
    double spread = s.along2 - s.along * along, both = s.both - s.along * off, left = s.off2 - s.off * off;
    if (!(spread > 0.0))
        return false;
    double slope = both / spread, residual = left - slope * both;
    *out = (struct nav_touches_line){.normal = atan2(ny, nx) - atan(slope),
                                     .x = nx * off - ny * along,
                                     .y = ny * off + nx * along,
                                     .normal_var = 1.0 / spread + s.turned,
                                     .offset_var = 1.0 / s.weight,
                                     .span = s.high - s.low,
                                     .used = on};
    return residual < STRAIGHT * (nav_touches_count(on) - 2) && out->normal_var < ANGLE_MOST * ANGLE_MOST;
}

static bool touches_line(const struct nav_touches *t, int at, uint64_t among, struct nav_touches_line *out)
{
    const struct nav_touch *a = &t->touch[at];
    double best_x = 0.0, best_y = 0.0;
    uint64_t best = 0;
    for (int k = 0; k < NAV_TOUCHES_MOST; k++) {
        if (!touches_has(among & t->held, k) || k == at)
            continue;
        double dx = t->touch[k].x - a->x, dy = t->touch[k].y - a->y, length = hypot(dx, dy);
        if (length < APART_LEAST || length > AWAY_MOST)
            continue;
        double nx = -dy / length, ny = dx / length;
        double side = nx * a->along_x + ny * a->along_y > 0.0 ? -1.0 : 1.0;
        uint64_t on = touches_on(t, among & t->held, a, side * nx, side * ny);
        if (nav_touches_count(on) > nav_touches_count(best)) {
            best = on;
            best_x = side * nx;
            best_y = side * ny;
        }
    }
    return nav_touches_count(best) >= LEAST && touches_regress(t, best, best_x, best_y, out);
}

/* Across the contact's reported normal. */
static bool touches_across(const struct nav_touch *a, int at, struct nav_touches_line *out)
{
    double variance = a->normal_var + a->turned;
    if (isnan(a->normal) || variance >= ANGLE_MOST * ANGLE_MOST)
        return false;
    *out = (struct nav_touches_line){.normal = a->normal,
                                     .x = a->x,
                                     .y = a->y,
                                     .normal_var = variance,
                                     .offset_var = a->variance,
                                     .used = 1ULL << at};
    return true;
}

bool nav_touches_fit(const struct nav_touches *t, int at, uint64_t among, struct nav_touches_line *out)
{
    return touches_line(t, at, among, out) || touches_across(&t->touch[at], at, out);
}
