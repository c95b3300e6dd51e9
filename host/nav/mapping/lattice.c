#include "lattice.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double PITCH_LEAST = 0.15, PITCH_MOST = 1.2, PITCH_STEP = 1.015; /* m, m, ratio */
static const double BORDER_SIGMA = 0.03;                                      /* m */
static const double KERNEL_LEAST = 0.01;                                      /* of a blur that is added */
static const double STRAY = 0.25;                                             /* share of borders that are on no line */
static const double EVIDENCE = 6.0;                                           /* nats */
static const double LIKE_PITCH = 0.04, LIKE_TURN = 0.12;                      /* ratio, rad: two candidates are one */
static const double DRIFT_M = 0.02;                                           /* of the trail between its parts */
enum { BORDERS_LEAST = 10, BINS = 48, KEPT = 24, TURNS = 30, SIDE = 64, CLIMBS = 12 };

/* Candidates, no two alike. */
struct lattice_list {
    int count;
    struct nav_lattice kept[KEPT];
};

int nav_lattice_search_init(struct nav_lattice_search *s, int classes)
{
    s->sum = calloc((size_t)SIDE * SIDE * (size_t)classes, sizeof *s->sum);
    s->used = calloc((size_t)SIDE * SIDE, sizeof *s->used);
    return s->sum && s->used ? 0 : -1;
}

void nav_lattice_search_free(struct nav_lattice_search *s)
{
    free(s->sum);
    free(s->used);
}

/* Density at `off` from the nearest line, over that of borders anywhere. */
static double lattice_peak(double off, double pitch)
{
    double z = (off - pitch * round(off / pitch)) / BORDER_SIGMA;
    return pitch * exp(-0.5 * z * z) / (BORDER_SIGMA * sqrt(2.0 * NAV_PI));
}

static double lattice_score(const struct nav_trail *t, const struct nav_lattice *l)
{
    double c = cos(l->turn), s = sin(l->turn), sum = 0.0;
    for (int n = 0; n < t->borders; n++) {
        double dx = t->border[n].x - l->x, dy = t->border[n].y - l->y;
        double peak = lattice_peak(c * dx + s * dy - l->u, l->pitch) + lattice_peak(c * dy - s * dx - l->v, l->pitch);
        sum += log(STRAY + (1.0 - STRAY) * peak / 2.0);
    }
    return sum;
}

/* The phase about which most values lie, by a histogram blurred with the borders' spread. */
static double lattice_phase(const double *value, int count, double pitch)
{
    double bin[3 * BINS] = {0.0}, *middle = bin + BINS, sum[BINS]; /* a period, and the ones beside it */
    int best = 0;
    for (int n = 0; n < count; n++) {
        double share = value[n] / pitch;
        middle[(int)((share - floor(share)) * BINS) % BINS] += 1.0;
    }
    memcpy(bin, middle, sizeof sum);
    memcpy(middle + BINS, middle, sizeof sum);
    memcpy(sum, middle, sizeof sum);
    for (int d = 1; d < BINS / 2; d++) {
        double kernel = exp(-0.5 * pow(d * pitch / BINS / BORDER_SIGMA, 2.0));
        if (!(kernel > KERNEL_LEAST))
            break;
        for (int b = 0; b < BINS; b++)
            sum[b] += kernel * (middle[b + d] + middle[b - d]);
    }
    for (int b = 1; b < BINS; b++)
        best = sum[b] > sum[best] ? b : best;
    return (best + 0.5) / BINS * pitch;
}

static void lattice_keep(struct lattice_list *list, const struct nav_lattice *l)
{
    int worst = 0;
    for (int n = 0; n < list->count; n++) {
        struct nav_lattice *other = &list->kept[n];
        if (fabs(log(other->pitch / l->pitch)) < LIKE_PITCH && fabs(other->turn - l->turn) < LIKE_TURN) {
            if (l->score > other->score)
                *other = *l;
            return;
        }
        worst = other->score < list->kept[worst].score ? n : worst;
    }
    if (list->count < KEPT)
        list->kept[list->count++] = *l;
    else if (l->score > list->kept[worst].score)
        list->kept[worst] = *l;
}

/* All pitches at one turn; u, v: the borders along it and across it. */
static void lattice_scan(const struct nav_trail *t, struct nav_lattice at, struct lattice_list *list)
{
    double u[NAV_TRAIL_BORDERS], v[NAV_TRAIL_BORDERS], c = cos(at.turn), s = sin(at.turn);
    for (int n = 0; n < t->borders; n++) {
        double dx = t->border[n].x - at.x, dy = t->border[n].y - at.y;
        u[n] = c * dx + s * dy;
        v[n] = c * dy - s * dx;
    }
    for (at.pitch = PITCH_LEAST; at.pitch < PITCH_MOST; at.pitch *= PITCH_STEP) {
        at.u = lattice_phase(u, t->borders, at.pitch);
        at.v = lattice_phase(v, t->borders, at.pitch);
        at.score = lattice_score(t, &at);
        lattice_keep(list, &at);
    }
}

/* One coordinate a little up or down, where that is better. */
static bool lattice_try(const struct nav_trail *t, struct nav_lattice *l, int coordinate, double step)
{
    for (int sign = -1; sign <= 1; sign += 2) {
        struct nav_lattice tried = *l;
        double *const of[4] = {&tried.turn, &tried.pitch, &tried.u, &tried.v};
        *of[coordinate] += sign * step;
        tried.score = lattice_score(t, &tried);
        if (tried.score > l->score) {
            *l = tried;
            return true;
        }
    }
    return false;
}

static void lattice_climb(const struct nav_trail *t, struct nav_lattice *l)
{
    double step[4] = {0.03, 0.01, 0.02, 0.02}; /* rad, m, m, m */
    for (int round = 0; round < CLIMBS; round++) {
        for (int k = 0; k < 4; k++)
            step[k] *= lattice_try(t, l, k, step[k]) ? 1.2 : 0.6;
    }
}

/* Log-likelihood of one tile's windows, each texture as likely as any other before. */
static double lattice_tile(const float *sum, int classes)
{
    double best = -INFINITY, total = 0.0;
    for (int k = 0; k < classes; k++)
        best = fmax(best, (double)sum[k]);
    for (int k = 0; k < classes; k++)
        total += exp((double)sum[k] - best);
    return best + log(total / classes);
}

/* Log-likelihood of all windows by tiles of one texture each. A tile and another 64 pitches away are taken as one. */
static double lattice_tiles(struct nav_lattice_search *s, const struct nav_trail *t, const struct nav_lattice *l)
{
    double total = 0.0, cosine = cos(l->turn), sine = sin(l->turn);
    memset(s->sum, 0, (size_t)SIDE * SIDE * (size_t)t->classes * sizeof *s->sum);
    memset(s->used, 0, (size_t)SIDE * SIDE * sizeof *s->used);
    for (int n = 0; n < t->count; n++) {
        double dx = t->point[n].x - l->x, dy = t->point[n].y - l->y;
        int column = (int)floor((cosine * dx + sine * dy - l->u) / l->pitch);
        int row = (int)floor((cosine * dy - sine * dx - l->v) / l->pitch);
        int at = (row & (SIDE - 1)) * SIDE + (column & (SIDE - 1));
        s->used[at] = true;
        for (int k = 0; k < t->classes; k++)
            s->sum[(ptrdiff_t)at * t->classes + k] += t->weight[(ptrdiff_t)n * t->classes + k];
    }
    for (int at = 0; at < SIDE * SIDE; at++)
        total += s->used[at] ? lattice_tile(s->sum + (ptrdiff_t)at * t->classes, t->classes) : 0.0;
    return total;
}

/* How far off it may be, by the number and spread of the borders. */
static void lattice_spread(const struct nav_trail *t, struct nav_lattice *l)
{
    double spread = 0.0;
    for (int n = 0; n < t->borders; n++)
        spread += pow(t->border[n].x - l->x, 2.0) + pow(t->border[n].y - l->y, 2.0);
    spread = fmax(sqrt(spread / (2.0 * t->borders)), l->pitch / 2.0);
    l->sigma_m = DRIFT_M + 2.0 * BORDER_SIGMA / (sqrt(t->borders / 2.0) * (1.0 - STRAY));
    l->sigma_turn = l->sigma_m / spread;
    l->sigma_pitch = l->sigma_turn * l->pitch;
}

bool nav_lattice_find(struct nav_lattice_search *s, const struct nav_trail *t, double axes, struct nav_lattice *out)
{
    struct lattice_list list = {.count = 0};
    struct nav_lattice at = {.turn = axes};
    if (t->borders < BORDERS_LEAST || t->classes < 2)
        return false;
    for (int n = 0; n < t->borders; n++) {
        at.x += t->border[n].x / t->borders;
        at.y += t->border[n].y / t->borders;
    }
    for (int turn = 0; turn < TURNS; turn++) {
        at.turn = axes + turn * NAV_PI / 2.0 / TURNS;
        lattice_scan(t, at, &list);
    }
    *out = (struct nav_lattice){.evidence = -INFINITY};
    for (int n = 0; n < list.count; n++) {
        lattice_climb(t, &list.kept[n]);
        list.kept[n].evidence = lattice_tiles(s, t, &list.kept[n]) - nav_trail_patches(t, false);
        if (list.kept[n].evidence > out->evidence)
            *out = list.kept[n];
    }
    lattice_spread(t, out);
    return out->evidence > EVIDENCE;
}
