#include <math.h>
#include <string.h>

#include "multi.h"

bool multi_normalise(struct multi_modes *m)
{
    double sum = 0.0;
    for (int k = 0; k < m->count; k++)
        sum += m->at[k].weight;
    if (!(sum > 0.0 && isfinite(sum)))
        return false;
    for (int k = 0; k < m->count; k++)
        m->at[k].weight /= sum;
    return true;
}

void multi_prune(struct multi_modes *m, double least)
{
    int heaviest = 0, kept = 0;
    for (int k = 1; k < m->count; k++)
        heaviest = m->at[k].weight > m->at[heaviest].weight ? k : heaviest;
    for (int k = 0; k < m->count; k++) {
        if (k == heaviest || m->at[k].weight >= least)
            m->at[kept++] = m->at[k];
    }
    m->count = kept;
    multi_normalise(m);
}

static void difference(const struct nav_gaussian *to, const struct nav_gaussian *from, double d[3])
{
    d[0] = to->mean.x - from->mean.x;
    d[1] = to->mean.y - from->mean.y;
    d[2] = nav_wrap(to->mean.theta - from->mean.theta);
}

static double distance2(const struct nav_gaussian *a, const struct nav_gaussian *b)
{
    double d[3], information[9], sum = 0.0;
    difference(b, a, d);
    if (!nav_gaussian_invert(a->covariance, information))
        return INFINITY;
    for (int i = 0; i < 9; i++)
        sum += d[i / 3] * information[i] * d[i % 3];
    return sum;
}

/* Moments of both in the first. */
static void absorb(struct multi_mode *a, const struct multi_mode *b)
{
    double d[3], share = b->weight / (a->weight + b->weight);
    difference(&b->belief, &a->belief, d);
    for (int i = 0; i < 9; i++)
        a->belief.covariance[i] = (1.0 - share) * a->belief.covariance[i] + share * b->belief.covariance[i] +
                                  share * (1.0 - share) * d[i / 3] * d[i % 3];
    a->belief.mean.x += share * d[0];
    a->belief.mean.y += share * d[1];
    a->belief.mean.theta = nav_wrap(a->belief.mean.theta + share * d[2]);
    a->weight = fmin(a->weight + b->weight, 1.0); /* shares that add up to 1 may do so and a bit more */
}

void multi_merge(struct multi_modes *m, double near)
{
    for (int i = 0; i < m->count; i++) {
        for (int j = i + 1; j < m->count; j++) {
            struct multi_mode *a = &m->at[i], *b = &m->at[j];
            const struct multi_mode *heavy = a->weight >= b->weight ? a : b, *light = heavy == a ? b : a;
            if (distance2(&heavy->belief, &light->belief) > near * near)
                continue;
            absorb(a, b);
            m->at[j--] = m->at[--m->count];
        }
    }
}

/* The mode whose mean is nearest to a pose, by NAV_NEAR_M and NAV_NEAR_RAD; *far: how far, NULL without modes. */
static struct multi_mode *nearest(struct multi_modes *m, const struct nav_gaussian *g, double *far)
{
    struct multi_mode *best = NULL;
    *far = INFINITY;
    for (int k = 0; k < m->count; k++) {
        double d[3];
        difference(g, &m->at[k].belief, d);
        double off = fmax(hypot(d[0], d[1]) / NAV_NEAR_M, fabs(d[2]) / NAV_NEAR_RAD);
        if (off < *far) {
            best = &m->at[k];
            *far = off;
        }
    }
    return best;
}

void multi_gather(struct multi_modes *m, const struct nav_component *bump, long count)
{
    m->count = 0;
    for (long n = 0; n < count; n++) {
        double far, xy = bump[n].sigma_m * bump[n].sigma_m, turn = bump[n].sigma_rad * bump[n].sigma_rad;
        struct multi_mode one = {{bump[n].pose, {xy, 0.0, 0.0, 0.0, xy, 0.0, 0.0, 0.0, turn}}, bump[n].mass};
        if (!(one.weight > 0.0))
            continue;
        struct multi_mode *mode = nearest(m, &one.belief, &far);
        if (far > 1.0 && m->count < m->room)
            m->at[m->count++] = one;
        else
            absorb(mode, &one);
    }
    multi_normalise(m);
}

void multi_root(const double c[9], double root[9])
{
    double a = sqrt(fmax(c[0], 0.0)), b = a > 0.0 ? c[3] / a : 0.0, d = a > 0.0 ? c[6] / a : 0.0;
    double e = sqrt(fmax(c[4] - b * b, 0.0)), f = e > 0.0 ? (c[7] - d * b) / e : 0.0;
    const double out[9] = {a, 0.0, 0.0, b, e, 0.0, d, f, sqrt(fmax(c[8] - d * d - f * f, 0.0))};
    memcpy(root, out, sizeof out);
}

static void mean_of(const struct multi_points *p, double mean[3])
{
    mean[0] = mean[1] = mean[2] = 0.0;
    for (int n = 0; n < p->count; n++) {
        for (int i = 0; i < 3; i++)
            mean[i] += p->weight[n] * p->offset[3 * n + i];
    }
}

struct nav_gaussian multi_fit(struct nav_pose from, const struct multi_points *p)
{
    double mean[3];
    mean_of(p, mean);
    struct nav_gaussian out = {.mean = {from.x + mean[0], from.y + mean[1], nav_wrap(from.theta + mean[2])}};
    for (int n = 0; n < p->count; n++) {
        const double *o = p->offset + 3 * n;
        for (int i = 0; i < 9; i++)
            out.covariance[i] += p->weight[n] * (o[i / 3] - mean[i / 3]) * (o[i % 3] - mean[i % 3]);
    }
    return out;
}

/* Direction of most variance, a radian counting as much as `ARM_M`; by power iteration. */
static void longest(const struct multi_points *p, double axis[3])
{
    static const double ARM_M = 0.2; /* from a robot's centre to its whiskers' tips, about */
    struct nav_gaussian g = multi_fit((struct nav_pose){0.0, 0.0, 0.0}, p);
    const double scale[3] = {1.0, 1.0, ARM_M};
    double v[3] = {1.0, 0.7, 0.4};
    for (int round = 0; round < 12; round++) {
        double next[3] = {0.0, 0.0, 0.0}, length = 0.0;
        for (int i = 0; i < 9; i++)
            next[i / 3] += scale[i / 3] * g.covariance[i] * scale[i % 3] * v[i % 3];
        for (int i = 0; i < 3; i++)
            length += next[i] * next[i];
        for (int i = 0; i < 3 && length > 0.0; i++)
            v[i] = next[i] / sqrt(length);
    }
    for (int i = 0; i < 3; i++)
        axis[i] = v[i] * scale[i];
}

static double along(const double *axis, const double *offset)
{
    return axis[0] * offset[0] + axis[1] * offset[1] + axis[2] * offset[2];
}

/* Weight and mean projection of the points below a cut. */
static void heap(const struct multi_points *p, const double *axis, double cut, double out[2])
{
    out[0] = out[1] = 0.0;
    for (int n = 0; n < p->count; n++) {
        double at = along(axis, p->offset + 3 * n);
        out[0] += at < cut ? p->weight[n] : 0.0;
        out[1] += at < cut ? p->weight[n] * at : 0.0;
    }
}

bool multi_split(const struct multi_points *p, double share, double *out)
{
    enum { ROUNDS = 8 };
    double axis[3], mean = 0.0, variance = 0.0, low[2] = {0.0, 0.0};
    longest(p, axis);
    for (int n = 0; n < p->count; n++)
        mean += p->weight[n] * along(axis, p->offset + 3 * n);
    for (int n = 0; n < p->count; n++) {
        double at = along(axis, p->offset + 3 * n) - mean;
        variance += p->weight[n] * at * at;
    }
    double cut = mean, between = 0.0;
    for (int round = 0; round < ROUNDS; round++) { /* two means on a line */
        heap(p, axis, cut, low);
        if (!(low[0] > 0.0 && low[0] < 1.0))
            return false;
        double a = low[1] / low[0], b = (mean - low[1]) / (1.0 - low[0]);
        cut = (a + b) / 2.0;
        between = low[0] * (1.0 - low[0]) * (b - a) * (b - a);
    }
    for (int n = 0; n < p->count; n++)
        out[n] = along(axis, p->offset + 3 * n) < cut ? p->weight[n] : 0.0;
    return between > share * variance;
}
