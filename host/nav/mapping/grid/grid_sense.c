#include "grid_sense.h"

#include <math.h>

#include "pose.h"

static const double NEAR_M = 0.03; /* contacts within about so much make the surface at a place */
/* What a surface is before anything is known of it: across the whisker, so thick and so wide. */
static const double THICK_M = 0.01, WIDE_M = 0.05;
static const double ROUGH_M = 0.001;
static const double SOLID = 0.02;        /* probability of a cell, before */
static const double EDGE_M = 0.006;      /* over which noticing a contact falls off */
static const double CHANGES_PER_M = 2.5; /* of texture */
static const float SURE_MOST = 12.0F;    /* nats of a patch */
enum { AROUND = 2, CLASSES_MOST = 256 };

struct grid_sums {
    double hits, passed, x, y, xx, xy, yy;
};

static double grid_middle(int index)
{
    return (index - NAV_GRID_SIDE / 2 + 0.5) * NAV_GRID_CELL_M;
}

/* Moments of the contacts near a place, about it. */
static struct grid_sums grid_gather(struct nav_grid g, double x, double y)
{
    struct grid_sums s = {0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
    int column = nav_grid_index(x), row = nav_grid_index(y);
    for (int r = row - AROUND; r <= row + AROUND; r++) {
        for (int c = column - AROUND; c <= column + AROUND; c++) {
            const struct nav_grid_cell *cell = nav_grid_cell_at(g.pool, g.map, c, r);
            double n = (double)cell->hits;
            if (!(n > 0.0))
                continue;
            double ox = grid_middle(c) - x, oy = grid_middle(r) - y;
            double mx = (double)cell->x / n + ox, my = (double)cell->y / n + oy;
            double w = exp(-(mx * mx + my * my) / (2.0 * NEAR_M * NEAR_M));
            s.hits += w * n;
            s.passed += w * (double)cell->passed;
            s.x += w * n * mx;
            s.y += w * n * my;
            s.xx += w * ((double)cell->xx + 2.0 * ox * (double)cell->x + n * ox * ox);
            s.xy += w * ((double)cell->xy + ox * (double)cell->y + oy * (double)cell->x + n * ox * oy);
            s.yy += w * ((double)cell->yy + 2.0 * oy * (double)cell->y + n * oy * oy);
        }
    }
    return s;
}

/* The scatter of the contacts and that of one that nobody felt, across the whisker: its least axis is the normal. */
bool nav_grid_surface(struct nav_grid g, double x, double y, const struct nav_grid_whisker *w,
                      struct nav_grid_surface *out)
{
    struct grid_sums s = grid_gather(g, x, y);
    if (s.hits < 1e-3)
        return false;
    double mx = s.x / s.hits, my = s.y / s.hits, total = s.hits + 1.0;
    double thick = THICK_M * THICK_M, wide = WIDE_M * WIDE_M;
    double xx = (s.xx - s.hits * mx * mx + thick * w->c * w->c + wide * w->s * w->s) / total;
    double xy = (s.xy - s.hits * mx * my + (thick - wide) * w->c * w->s) / total;
    double yy = (s.yy - s.hits * my * my + thick * w->s * w->s + wide * w->c * w->c) / total;
    double half = 0.5 * (xx - yy), root = sqrt(half * half + xy * xy), mean = 0.5 * (xx + yy);
    double along = 0.5 * atan2(xy, half), nx = -sin(along), ny = cos(along); /* across the greatest axis */
    double facing = -(nx * w->c + ny * w->s), sign = facing < 0.0 ? -1.0 : 1.0;
    double least = fmax(mean - root, ROUGH_M * ROUGH_M), most = mean + root;
    *out = (struct nav_grid_surface){.x = x + mx,
                                     .y = y + my,
                                     .nx = sign * nx,
                                     .ny = sign * ny,
                                     .facing = fabs(facing),
                                     .variance = least * (1.0 + 1.0 / total),
                                     .normal_var = least / (total * most),
                                     .there = s.hits / (s.hits + s.passed + 1.0)};
    return true;
}

static double grid_normal_density(double off, double variance)
{
    return exp(-0.5 * off * off / variance) / sqrt(2.0 * NAV_PI * variance);
}

double nav_grid_of_surface(const struct nav_grid_surface *f, const struct nav_grid_whisker *w, double off,
                           double variance)
{
    return (1.0 - w->miss) * f->there * f->facing * grid_normal_density(off, variance + f->variance);
}

double nav_grid_of_others(struct nav_grid g, const struct nav_grid_whisker *w, double distance)
{
    const struct nav_grid_cell *cell =
        nav_grid_cell_at(g.pool, g.map, nav_grid_index(w->x + distance * w->c), nav_grid_index(w->y + distance * w->s));
    double solid = SOLID / (1.0 + (double)cell->passed);
    return w->ghost / w->length + (1.0 - w->miss) * solid / NAV_GRID_CELL_M;
}

/* Probability that a whisker is stopped in a cell, if it reaches `reach` m. */
static double grid_stopped(const struct nav_grid_cell *cell, int column, int row, const struct nav_grid_whisker *w,
                           double reach)
{
    double n = (double)cell->hits, solid = (n + SOLID) / (n + (double)cell->passed + 1.0);
    if (!(n > 0.0))
        return solid;
    double dx = grid_middle(column) + (double)cell->x / n - w->x, dy = grid_middle(row) + (double)cell->y / n - w->y;
    double beyond = reach - (dx * w->c + dy * w->s), beside = (dy * w->c - dx * w->s) / (0.5 * NAV_GRID_CELL_M);
    return solid * 0.5 * erfc(-beyond / (sqrt(2.0) * hypot(EDGE_M, w->sigma))) * exp(-0.5 * beside * beside);
}

/* Log of the probability that nothing is met up to `reach` m. */
static double grid_passes(struct nav_grid g, const struct nav_grid_whisker *w, double reach)
{
    double product = 1.0;
    int last_column = -1, last_row = -1;
    for (double at = 0.5 * NAV_GRID_CELL_M; at < reach; at += NAV_GRID_CELL_M) {
        int column = nav_grid_index(w->x + at * w->c), row = nav_grid_index(w->y + at * w->s);
        if (column == last_column && row == last_row)
            continue;
        last_column = column;
        last_row = row;
        const struct nav_grid_cell *cell = nav_grid_cell_at(g.pool, g.map, column, row);
        product *= 1.0 - (1.0 - w->miss) * grid_stopped(cell, column, row, w, reach);
    }
    return log(product);
}

double nav_grid_contact(struct nav_grid g, const struct nav_grid_whisker *w, double distance)
{
    struct nav_grid_surface f;
    if (isinf(distance))
        return log(1.0 - w->ghost) + grid_passes(g, w, w->length);
    double x = w->x + distance * w->c, y = w->y + distance * w->s, density = nav_grid_of_others(g, w, distance);
    if (nav_grid_surface(g, x, y, w, &f))
        density += nav_grid_of_surface(&f, w, f.nx * (x - f.x) + f.ny * (y - f.y), 0.0);
    double before = fmax(distance - 2.0 * hypot(EDGE_M, w->sigma), 0.0);
    return log(density * w->length) + grid_passes(g, w, before);
}

static void grid_learn_passed(struct nav_grid g, const struct nav_grid_whisker *w, double reach, double weight)
{
    int last_column = -1, last_row = -1;
    for (double at = 0.5 * NAV_GRID_CELL_M; at < reach; at += NAV_GRID_CELL_M) {
        int column = nav_grid_index(w->x + at * w->c), row = nav_grid_index(w->y + at * w->s);
        if (column == last_column && row == last_row)
            continue;
        last_column = column;
        last_row = row;
        struct nav_grid_cell *cell = nav_grid_cell_for(g.pool, g.map, column, row);
        if (cell)
            cell->passed += (float)(weight * (1.0 - w->miss));
    }
}

void nav_grid_learn_contact(struct nav_grid g, const struct nav_grid_whisker *w, double distance, double weight)
{
    grid_learn_passed(g, w, isinf(distance) ? w->length : distance - 1.5 * NAV_GRID_CELL_M, weight);
    if (isinf(distance))
        return;
    double x = w->x + distance * w->c, y = w->y + distance * w->s;
    int column = nav_grid_index(x), row = nav_grid_index(y);
    struct nav_grid_cell *cell = nav_grid_cell_for(g.pool, g.map, column, row);
    if (!cell)
        return;
    double ox = x - grid_middle(column), oy = y - grid_middle(row);
    cell->hits += (float)weight;
    cell->x += (float)(weight * ox);
    cell->y += (float)(weight * oy);
    cell->xx += (float)(weight * ox * ox);
    cell->xy += (float)(weight * ox * oy);
    cell->yy += (float)(weight * oy * oy);
}

/* Multiplies p by what a neighbouring patch says: of the same texture but for a change between. */
static void grid_hear(const float *patch, int classes, double keep, double *p)
{
    double best = -INFINITY, total = 0.0, own[CLASSES_MOST];
    for (int k = 0; k < classes; k++)
        best = fmax(best, (double)patch[k]);
    for (int k = 0; k < classes; k++)
        total += own[k] = exp((double)patch[k] - best);
    for (int k = 0; k < classes; k++)
        p[k] *= keep * own[k] / total + (1.0 - keep) / classes;
}

double nav_grid_texture(struct nav_grid g, double x, double y, const float *ratio)
{
    static const int NEIGHBOUR[5][2] = {{0, 0}, {1, 0}, {-1, 0}, {0, 1}, {0, -1}};
    double p[CLASSES_MOST], total = 0.0, sum = 0.0, keep = exp(-CHANGES_PER_M * NAV_GRID_PATCH * NAV_GRID_CELL_M);
    int classes = g.pool->classes, column = nav_grid_index(x), row = nav_grid_index(y);
    for (int k = 0; k < classes; k++)
        p[k] = 1.0;
    for (int n = 0; n < 5; n++) {
        const float *patch = nav_grid_patch_at(g.pool, g.map, column + NAV_GRID_PATCH * NEIGHBOUR[n][0],
                                               row + NAV_GRID_PATCH * NEIGHBOUR[n][1]);
        bool read = false;
        for (int k = 0; k < classes; k++)
            read = read || patch[k] != 0.0F;
        if (read)
            grid_hear(patch, classes, n == 0 ? 1.0 : keep, p);
    }
    for (int k = 0; k < classes; k++) {
        total += p[k];
        sum += p[k] * (double)ratio[k];
    }
    return log(sum / total);
}

void nav_grid_learn_texture(struct nav_grid g, double x, double y, const float *ratio)
{
    float *patch = nav_grid_patch_for(g.pool, g.map, nav_grid_index(x), nav_grid_index(y)), most = -INFINITY;
    if (!patch)
        return;
    for (int k = 0; k < g.pool->classes; k++) {
        patch[k] += logf(ratio[k]);
        most = fmaxf(most, patch[k]);
    }
    for (int k = 0; k < g.pool->classes; k++)
        patch[k] = fmaxf(patch[k] - most, -SURE_MOST);
}
