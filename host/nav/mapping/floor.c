#include "floor.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "face.h"

static const double BLUR_M = 0.012; /* of a border, as windows show it */
static const double NEAR = 3.0;     /* standard deviations from a border within which it matters */
static const double SURE = 0.9;     /* of a tile's texture, before its borders correct the pose */
static const double AGREEMENT_WINDOWS = 60.0, AGREEMENT_LEAST = -0.2; /* nats */

int nav_floor_init(struct nav_floor *f, int classes)
{
    *f = (struct nav_floor){.classes = classes};
    f->tile = calloc((size_t)NAV_FLOOR_SIDE * NAV_FLOOR_SIDE * (size_t)classes, sizeof *f->tile);
    return f->tile ? 0 : -1;
}

void nav_floor_free(struct nav_floor *f)
{
    free(f->tile);
}

void nav_floor_copy(struct nav_floor *to, const struct nav_floor *from)
{
    float *tile = to->tile;
    *to = *from;
    to->tile = tile;
    if (from->known)
        memcpy(tile, from->tile, (size_t)NAV_FLOOR_SIDE * NAV_FLOOR_SIDE * (size_t)from->classes * sizeof *tile);
}

/* NULL: beyond the lattice. */
static float *floor_tile(const struct nav_floor *f, int column, int row)
{
    int c = column + NAV_FLOOR_SIDE / 2, r = row + NAV_FLOOR_SIDE / 2;
    if (c < 0 || r < 0 || c >= NAV_FLOOR_SIDE || r >= NAV_FLOOR_SIDE)
        return NULL;
    return f->tile + (ptrdiff_t)(r * NAV_FLOOR_SIDE + c) * f->classes;
}

/* p(window | tile) / p(window | any), by what is believed of the tile. */
static double floor_ratio(const struct nav_floor *f, const float *tile, const float *ratio)
{
    double best = -INFINITY, total = 0.0, sum = 0.0;
    if (!tile)
        return 1.0;
    for (int k = 0; k < f->classes; k++)
        best = fmax(best, (double)tile[k]);
    for (int k = 0; k < f->classes; k++) {
        double p = exp((double)tile[k] - best);
        total += p;
        sum += p * (double)ratio[k];
    }
    return sum / total;
}

/* Probability that a tip is beyond a border, so many standard deviations from it. */
static double floor_beyond(double z)
{
    return 0.5 * erfc(z / sqrt(2.0));
}

static void floor_learn(const struct nav_floor *f, float *tile, double share, const float *ratio)
{
    for (int k = 0; tile && k < f->classes; k++)
        tile[k] += (float)share * logf(ratio[k]);
}

/* Probability of the tile's likeliest texture. */
static double floor_sure(const struct nav_floor *f, const float *tile)
{
    double best = -INFINITY, total = 0.0;
    if (!tile)
        return 0.0;
    for (int k = 0; k < f->classes; k++)
        best = fmax(best, (double)tile[k]);
    for (int k = 0; k < f->classes; k++)
        total += exp((double)tile[k] - best);
    return 1.0 / total;
}

/* A tip in the lattice: its tile, the nearest line and the tile beyond it. */
struct floor_view {
    int column, row, across_column, across_row;
    double off;             /* m from the line, into the tip's own tile: above 0 */
    struct nav_linear form; /* of `off` */
};

/* A tip's place in the lattice. */
struct floor_place {
    double nx, ny, lx, ly; /* the lattice's first axis; the tip from the robot's centre, along the world's axes */
    double at[2];          /* m from the reference, along both axes */
    double tile[2];        /* tiles from the lines through tile (0, 0) */
};

static struct floor_place floor_place(const struct nav_floor *f, const double *m, double x, double y)
{
    double c = cos(m[NAV_JOINT_HEADING]), s = sin(m[NAV_JOINT_HEADING]);
    struct floor_place p = {.lx = c * x - s * y, .ly = s * x + c * y};
    p.nx = cos(m[NAV_JOINT_LATTICE_TURN]);
    p.ny = sin(m[NAV_JOINT_LATTICE_TURN]);
    double dx = m[NAV_JOINT_X] + p.lx - f->x, dy = m[NAV_JOINT_Y] + p.ly - f->y;
    p.at[0] = p.nx * dx + p.ny * dy;
    p.at[1] = p.nx * dy - p.ny * dx;
    p.tile[0] = (p.at[0] - m[NAV_JOINT_LATTICE_U]) / m[NAV_JOINT_PITCH];
    p.tile[1] = (p.at[1] - m[NAV_JOINT_LATTICE_V]) / m[NAV_JOINT_PITCH];
    return p;
}

/* m from a line of the lattice along an axis, times `sign`. */
static struct nav_linear floor_form(const struct floor_place *p, int axis, double line, double sign)
{
    struct nav_linear form = {.terms = 0};
    double ax = axis ? -p->ny : p->nx, ay = axis ? p->nx : p->ny;
    nav_linear_add(&form, NAV_JOINT_X, sign * ax);
    nav_linear_add(&form, NAV_JOINT_Y, sign * ay);
    nav_linear_add(&form, NAV_JOINT_HEADING, sign * (ay * p->lx - ax * p->ly));
    nav_linear_add(&form, NAV_JOINT_LATTICE_TURN, sign * (axis ? -p->at[0] : p->at[1]));
    nav_linear_add(&form, axis ? NAV_JOINT_LATTICE_V : NAV_JOINT_LATTICE_U, -sign);
    nav_linear_add(&form, NAV_JOINT_PITCH, -sign * line);
    return form;
}

static void floor_look(const struct nav_floor *f, const struct nav_joint *j, double x, double y, struct floor_view *v)
{
    struct floor_place p = floor_place(f, j->mean, x, y);
    double line[2] = {round(p.tile[0]), round(p.tile[1])};
    double off[2] = {p.tile[0] - line[0], p.tile[1] - line[1]};
    int axis = fabs(off[0]) < fabs(off[1]) ? 0 : 1, step = off[axis] < 0.0 ? -1 : 1;
    *v = (struct floor_view){.column = (int)floor(p.tile[0]),
                             .row = (int)floor(p.tile[1]),
                             .off = fabs(off[axis]) * j->mean[NAV_JOINT_PITCH],
                             .form = floor_form(&p, axis, line[axis], step)};
    v->across_column = axis ? v->column : v->column - step;
    v->across_row = axis ? v->row - step : v->row;
}

static void floor_forget(struct nav_floor *f)
{
    memset(f->tile, 0, (size_t)NAV_FLOOR_SIDE * NAV_FLOOR_SIDE * (size_t)f->classes * sizeof *f->tile);
    f->agreement = 0.0;
}

/* A floor that keeps being otherwise is learned anew. */
static double floor_agree(struct nav_floor *f, double log_likelihood)
{
    f->evidence += log_likelihood;
    f->agreement += (log_likelihood - f->agreement) / AGREEMENT_WINDOWS;
    if (f->agreement < AGREEMENT_LEAST)
        floor_forget(f);
    return log_likelihood;
}

void nav_floor_at(const struct nav_floor *f, const struct nav_joint *j, double x, double y, int *column, int *row)
{
    struct floor_place p = floor_place(f, j->mean, x, y);
    *column = (int)floor(p.tile[0]);
    *row = (int)floor(p.tile[1]);
}

/* The window is of the tip's own tile with the probability that the tip is on this side; the moments of the Gaussian
 * that comes nearest to the product (assumed-density filtering). */
double nav_floor_take(struct nav_floor *f, struct nav_joint *j, double x, double y, const float *ratio)
{
    struct floor_view v;
    if (!f->known)
        return 0.0;
    floor_look(f, j, x, y, &v);
    float *own = floor_tile(f, v.column, v.row), *across = floor_tile(f, v.across_column, v.across_row);
    double variance = nav_joint_variance(j, &v.form), sd = sqrt(variance + BLUR_M * BLUR_M), z = v.off / sd;
    double a = floor_ratio(f, own, ratio), b = floor_ratio(f, across, ratio), beyond = floor_beyond(z);
    if (z > NEAR) {
        floor_learn(f, own, 1.0, ratio);
        return floor_agree(f, log(a));
    }
    double total = a * (1.0 - beyond) + b * beyond, density = exp(-0.5 * z * z) / (sd * sqrt(2.0 * NAV_PI));
    double slope = (a - b) * density / total, curve = -z / sd * slope - slope * slope;
    bool sure = floor_sure(f, own) > SURE && floor_sure(f, across) > SURE;
    floor_learn(f, own, a * (1.0 - beyond) / total, ratio);
    floor_learn(f, across, b * beyond / total, ratio);
    if (sure)
        nav_joint_correct(j, &v.form, variance, variance * slope, variance * (1.0 + variance * curve));
    return floor_agree(f, log(total));
}

double nav_floor_sure(const struct nav_floor *f, int column, int row, int *texture)
{
    const float *tile = f->known ? floor_tile(f, column, row) : NULL;
    bool read = false;
    *texture = 0;
    for (int k = 0; tile && k < f->classes; k++) {
        read = read || tile[k] != 0.0F;
        *texture = tile[k] > tile[*texture] ? k : *texture;
    }
    return read ? floor_sure(f, tile) : 0.0;
}

void nav_floor_adopt(struct nav_floor *f, struct nav_joint *j, const struct nav_lattice *l, bool right)
{
    f->known = true;
    f->x = l->x;
    f->y = l->y;
    f->evidence = 0.0;
    floor_forget(f);
    nav_joint_set(j, NAV_JOINT_LATTICE_U, l->u, l->sigma_m * l->sigma_m);
    nav_joint_set(j, NAV_JOINT_LATTICE_V, l->v, l->sigma_m * l->sigma_m);
    nav_joint_set(j, NAV_JOINT_PITCH, l->pitch, l->sigma_pitch * l->sigma_pitch);
    nav_joint_set(j, NAV_JOINT_LATTICE_TURN, l->turn, l->sigma_turn * l->sigma_turn);
    struct nav_linear form = {.terms = 0};
    nav_linear_add(&form, NAV_JOINT_LATTICE_TURN, 1.0);
    nav_linear_add(&form, NAV_JOINT_AXES, -1.0);
    if (right)
        nav_joint_measure(j, &form, j->mean[NAV_JOINT_AXES] - l->turn, NAV_FACE_RIGHT_RAD * NAV_FACE_RIGHT_RAD);
}
