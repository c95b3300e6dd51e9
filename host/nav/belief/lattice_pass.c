/* One pass over the lattice: cells moved, noise added, likelihood applied, sums taken; row by row, so that what is in
 * the making stays in the nearest cache and each cell is read and written once.
 *
 * Sums run in fixed lanes of single precision along a row and in double precision over rows: the result does not depend
 * on how wide the machine's vectors are. */
#include "lattice_pass.h"

#include <math.h>
#include <string.h>

#include "lattice.h"

/* Blurring costs work, so variance is saved up to this share of a squared cell edge ... */
static const double OWED_LEAST = 0.04;
/* ... and no pass of the three-point kernel takes more than this (its centre weight stays above 1/2). */
static const double PASS_MOST = 0.5;
static const double PASSES_MOST = 100.0;

/* A neighbouring slice, poured into this one where its cells fall: split between four cells, so that the mean stays. */
struct pour {
    const float *slice;
    int dx, dy;              /* whole cells */
    const float *near, *far; /* source rows for dy and dy + 1 */
    float *near_room, *far_room;
};

struct pass {
    struct nav_lattice *l;
    const struct nav_lattice_weigh *limit; /* its begin and end hold, or NULL */
    const struct nav_lattice_weigh *weigh; /* it is applied, too, or NULL */
    float side, side_turn;                 /* of the three-point kernels, 0: none */
    int i0, i1, j0, j1;                    /* cells outside hold nothing */
    float *coordinate;                     /* [nx] of cells in x, relative to `about` */
    float *like;                           /* [nx] likelihoods */
    float *own, *mixed;                    /* scratch rows */
    float *room[3];                        /* for three rows blurred along x, taken in turn: */
    const float *above, *at, *below;       /* j - 1, j, j + 1 */
    struct pour pour[2];
    float weight[8]; /* of a pour's cells at (dx, dy), (dx + 1, dy), (dx, dy + 1), (dx + 1, dy + 1) */
    const struct nav_rows *rows;
    float peak; /* largest cell so far */
};

static void lay_out(struct pass *s, struct nav_lattice *l)
{
    float *row[NAV_PASS_ROWS];
    for (int r = 0; r < NAV_PASS_ROWS; r++)
        row[r] = l->rows + (size_t)r * nav_pass_pitch(l->nx) + NAV_PASS_PAD;
    s->coordinate = row[0];
    s->like = row[1];
    s->own = row[2];
    s->mixed = row[3];
    for (int r = 0; r < 3; r++)
        s->room[r] = row[4 + r];
    for (int q = 0; q < 2; q++) {
        s->pour[q].near_room = row[7 + 2 * q];
        s->pour[q].far_room = row[8 + 2 * q];
    }
}

/* Cells i0 - 2 .. i1 + 1 of row j of a slice, moved right by dx; empty where there is no cell. Points into the slice
 * where it can, else to `room`. */
static const float *fetch(const struct pass *s, const float *slice, int j, int dx, float *room)
{
    int low = s->i0 - 2, high = s->i1 + 2, nx = s->l->nx;
    int from = dx > low ? dx : low, to = nx + dx < high ? nx + dx : high;
    if (j < 0 || j >= s->l->ny || from >= to)
        from = to = high;
    const float *row = slice + (ptrdiff_t)j * nx - dx;
    if (from == low && to == high)
        return row;
    for (int i = low; i < from; i++)
        room[i] = 0.0f;
    if (from < to)
        memcpy(room + from, row + from, (size_t)(to - from) * sizeof *room);
    for (int i = to; i < high; i++)
        room[i] = 0.0f;
    return room;
}

/* Row j after whole-cell moves and the blur over headings. Rows must be asked for in order. */
static const float *moved_row(struct pass *s, int p, int j, float *out)
{
    const struct nav_lattice *l = s->l;
    const float *slice = nav_lattice_slice(l, p);
    if (!(s->side_turn > 0.0f))
        return fetch(s, slice, j - l->roll_y[p], l->roll_x[p], out);
    const float *own = fetch(s, slice, j - l->roll_y[p], l->roll_x[p], s->own), *from[4];
    for (int q = 0; q < 2; q++) {
        struct pour *pour = &s->pour[q];
        float *room = pour->far_room;
        pour->far_room = pour->near_room;
        pour->near_room = room;
        pour->far = pour->near;
        pour->near = fetch(s, pour->slice, j - pour->dy, pour->dx, room);
        from[2 * q] = pour->near;
        from[2 * q + 1] = pour->far;
    }
    s->rows->mix(own, s->side_turn, from, s->weight, s->i0 - 1, s->i1 + 1, out);
    /* What is poured beyond the lattice is lost. */
    if (j < 0 || j >= l->ny)
        memset(out + s->i0 - 1, 0, (size_t)(s->i1 - s->i0 + 2) * sizeof *out);
    out[s->i0 - 1] *= s->i0 > 0 ? 1.0f : 0.0f;
    out[s->i1] *= s->i1 < l->nx ? 1.0f : 0.0f;
    return out;
}

/* The same, blurred along x; points to `out` or into the lattice. */
static const float *blurred_row(struct pass *s, int p, int j, float *out)
{
    if (!(s->side > 0.0f))
        return moved_row(s, p, j, out);
    s->rows->blur(moved_row(s, p, j, s->mixed), s->side, s->i0, s->i1, out);
    return out;
}

static void note_peak(struct pass *s, const float peak[NAV_LANES], int slice)
{
    for (int k = 0; k < NAV_LANES; k++) {
        if (peak[k] <= s->peak)
            continue;
        s->peak = peak[k];
        s->l->peak_slice = slice;
    }
}

/* How slice q's cells fall on those of slice p, given `side` of its mass. */
static void set_pour(struct pass *s, int n, int p, int q)
{
    const struct nav_lattice *l = s->l;
    struct pour *pour = &s->pour[n];
    double x = (l->shift_x[q] - l->shift_x[p]) / l->cell, y = (l->shift_y[q] - l->shift_y[p]) / l->cell;
    double fx = x - floor(x), fy = y - floor(y), side = (double)s->side_turn;
    pour->slice = nav_lattice_slice(l, q);
    pour->dx = l->roll_x[q] + (int)floor(x);
    pour->dy = l->roll_y[q] + (int)floor(y);
    const double weights[] = {(1.0 - fx) * (1.0 - fy), fx * (1.0 - fy), (1.0 - fx) * fy, fx * fy};
    for (int k = 0; k < 4; k++)
        s->weight[4 * n + k] = (float)(side * weights[k]);
}

static void begin_slice(struct pass *s, int p)
{
    const struct nav_lattice *l = s->l;
    nav_slice_coordinates(0.5 * l->cell + l->shift_x[p] - l->moment_x, l->cell, l->nx, s->coordinate);
    if (s->side_turn > 0.0f) {
        set_pour(s, 0, p, (p + 1) % l->nh);
        set_pour(s, 1, p, (p + l->nh - 1) % l->nh);
        for (int q = 0; q < 2; q++) /* the first row asked for is j0 - 1: its far row is the near one before it */
            s->pour[q].near =
                fetch(s, s->pour[q].slice, s->j0 - 2 - s->pour[q].dy, s->pour[q].dx, s->pour[q].near_room);
    }
    s->at = blurred_row(s, p, s->j0 - 1, s->room[0]);
    s->below = blurred_row(s, p, s->j0, s->room[1]);
}

static void next_row(struct pass *s, int p, int j)
{
    s->above = s->at;
    s->at = s->below;
    s->below = blurred_row(s, p, j + 1, s->room[(j + 2 - s->j0) % 3]);
}

/* Likelihoods of a row's cells, 0 for a few beyond its end. */
static void look_up(const struct pass *s, int p, int j, int begin, int end)
{
    if (s->weigh)
        s->weigh->row(s->weigh->self, p, j, begin, end, s->like);
    memset(s->like + end, 0, NAV_LANES * sizeof *s->like);
}

static void run_slice(struct pass *s, int p)
{
    struct nav_lattice *l = s->l;
    float scale = (float)l->scale;
    double y0 = 0.5 * l->cell + l->shift_y[p] - l->moment_y;
    struct nav_row_sums sums = {.peak = {0.0f}};
    struct nav_row_weigh w = {.like = s->like, .coordinate = s->coordinate};
    w.centre = scale * (1.0f - 2.0f * s->side);
    w.side = scale * s->side;
    w.extra = s->weigh ? (float)s->weigh->extra : 0.0f;
    w.out = l->spare + ((size_t)p * (size_t)l->ny + (size_t)s->j0) * (size_t)l->nx;
    begin_slice(s, p);
    for (int j = s->j0; j < s->j1; j++, w.out += l->nx) {
        next_row(s, p, j);
        w.begin = s->limit ? s->limit->begin[j] : 0;
        w.end = s->limit ? s->limit->end[j] : l->nx;
        if (w.begin >= w.end)
            continue;
        look_up(s, p, j, w.begin, w.end);
        w.above = s->above;
        w.at = s->at;
        w.below = s->below;
        w.y = (float)(y0 + j * l->cell);
        s->rows->weigh(&w, &sums);
    }
    note_peak(s, sums.peak, p);
    nav_slice_moments(&sums, l->moment[p]);
    l->total += l->moment[p][0];
}

/* Rows and columns that may hold anything. */
static void set_limits(struct pass *s)
{
    const struct nav_lattice *l = s->l;
    s->i0 = s->limit ? l->nx : 0;
    s->i1 = s->limit ? 0 : l->nx;
    s->j0 = 0;
    s->j1 = s->limit ? 0 : l->ny;
    for (int j = 0; s->limit && j < l->ny; j++) {
        int begin = s->limit->begin[j], end = s->limit->end[j];
        if (begin >= end)
            continue;
        s->j0 = s->j1 > 0 ? s->j0 : j;
        s->j1 = j + 1;
        s->i0 = begin < s->i0 ? begin : s->i0;
        s->i1 = end > s->i1 ? end : s->i1;
    }
}

static void run(struct pass s)
{
    struct nav_lattice *l = s.l;
    s.rows = nav_rows_best();
    lay_out(&s, l);
    set_limits(&s);
    for (int i = 0; i < l->nx; i++)
        s.like[i] = 1.0f;
    memset(l->moment, 0, (size_t)l->nh * sizeof *l->moment);
    l->total = 0.0;
    l->peak_slice = 0;
    for (int p = 0; p < l->nh && s.j0 < s.j1; p++)
        run_slice(&s, p);
    float *done = l->spare;
    l->spare = l->mass;
    l->mass = done;
    l->scale = 1.0;
    memset(l->roll_x, 0, (size_t)l->nh * sizeof *l->roll_x);
    memset(l->roll_y, 0, (size_t)l->nh * sizeof *l->roll_y);
}

/* Takes what is due of owed variance: the number of passes and the side weight of each. A pass with side weight s adds
 * 2 s cell^2. */
static int due(double *owed, double cell, double *side)
{
    double share = fmin(*owed / (cell * cell), PASS_MOST * PASSES_MOST);
    *side = 0.0;
    if (share < OWED_LEAST)
        return 0;
    int passes = (int)ceil(share / PASS_MOST);
    *side = share / passes / 2.0;
    *owed = 0.0;
    return passes;
}

void nav_lattice_pass(struct nav_lattice *l, const struct nav_lattice_weigh *weigh, struct nav_pose about)
{
    l->moment_x = about.x;
    l->moment_y = about.y;
    double side, side_turn;
    int passes = due(&l->owed_position, l->cell, &side), turns = due(&l->owed_heading, l->cell_theta, &side_turn);
    for (int left = passes > turns ? passes : turns; left > 1; left--, passes--, turns--) {
        struct pass noise = {.l = l, .limit = weigh};
        noise.side = passes > 0 ? (float)side : 0.0f;
        noise.side_turn = turns > 0 ? (float)side_turn : 0.0f;
        run(noise);
    }
    struct pass last = {.l = l, .limit = weigh, .weigh = weigh};
    last.side = passes > 0 ? (float)side : 0.0f;
    last.side_turn = turns > 0 ? (float)side_turn : 0.0f;
    run(last);
}
