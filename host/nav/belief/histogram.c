#include "histogram.h"

#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Cells that the blur of one pass reaches, and lines that it takes from. */
enum { NAV_BLUR_MOST = 4, NAV_BLUR_LINES = 2 * NAV_BLUR_MOST + 1 };

/* A group's cells, wherever they lie in memory. */
typedef float nav_lanes __attribute__((vector_size(NAV_LANES * sizeof(float)), aligned(sizeof(float)), may_alias));
typedef int32_t nav_lane_counts __attribute__((vector_size(NAV_LANES * sizeof(int32_t)), aligned(sizeof(int32_t))));

/* A line written out. Groups outside begin .. end - 1 hold nothing; some cells beyond both ends may be written. */
struct nav_line {
    float *cell;
    int begin, end;
};

/* Noise that a pass adds. */
struct nav_blur {
    int reach;                                           /* cells, of the position's */
    float along[NAV_BLUR_LINES], across[NAV_BLUR_LINES]; /* its kernels, their middle at [reach] */
    float side_turn;                                     /* weight of a neighbour in the headings' */
};

/* Sums of a line, by lane: mass, that times x, xx; cells with mass; heaviest cell. */
struct nav_line_sums {
    nav_lanes mass[3], peak;
    nav_lane_counts cells;
};

/* A pass under way. */
struct nav_pass {
    const struct nav_weigh *weigh;
    struct nav_blur blur;
    int *roll_x, *roll_y; /* [nh] whole cells that slices move by */
    uint32_t groups;      /* stored so far */
    int slice, line;      /* that is made now; lines of the slice before */
    int made;             /* this one are written out */
    struct nav_line raw, blurred[NAV_BLUR_LINES];
    const float *row[NAV_BLUR_LINES]; /* lines that this one takes from */
    struct nav_line_sums sums;
    double total;
    long touched;
};

static void histogram_line_widen(struct nav_line *line, int begin, int end)
{
    line->begin = begin < line->begin ? begin : line->begin;
    line->end = end > line->end ? end : line->end;
}

static void histogram_line_clear(struct nav_line *line)
{
    if (line->end > line->begin)
        memset(line->cell + line->begin * NAV_LANES, 0,
               (size_t)(line->end - line->begin) * NAV_LANES * sizeof *line->cell);
    line->begin = INT_MAX;
    line->end = 0;
}

/* Whether any cell of a group holds mass: none is below 0. */
static bool histogram_group_any(const float *mass)
{
    uint32_t bits[NAV_LANES], all = 0;
    memcpy(bits, mass, sizeof bits);
    for (int k = 0; k < NAV_LANES; k++)
        all |= bits[k];
    return all << 1 != 0;
}

/* Adds a group to the store, when there is room; ends a line. */
static void histogram_store_group(struct nav_histogram *h, int group, const float *mass)
{
    uint32_t n = h->pass->groups;
    if (n == h->room)
        return;
    h->next.at[n] = (uint16_t)group;
    memcpy(h->next.mass + (size_t)n * NAV_LANES, mass, NAV_LANES * sizeof *mass);
    h->pass->groups++;
}

static void histogram_end_line(struct nav_histogram *h, size_t line)
{
    h->next.first[line + 1] = h->pass->groups;
}

/* Adds to a shift and returns the whole cells that it has gathered, at most `most` either way; beyond these the shift
 * stays within half a cell. */
static int histogram_carry(double *shift, double by, double cell, int most)
{
    double whole = floor((*shift + by) / cell + 0.5);
    *shift += by - whole * cell;
    return (int)fmax(fmin(whole, most), -most);
}

enum { PAD = 2 * NAV_LANES }; /* cells on both sides of a line written out */

struct nav_shape nav_levels_shape(const struct nav_levels *l, int level)
{
    struct nav_shape s = {.nh = l->headings, .cell = ldexp(l->cell, level)};
    for (int n = 0; n < level && s.nh % 2 == 0 && s.nh / 2 >= l->headings_least; n++)
        s.nh /= 2;
    s.nx = (int)ceil(l->size_x / s.cell - 1e-6);
    s.ny = (int)ceil(l->size_y / s.cell - 1e-6);
    s.groups = (s.nx + NAV_LANES - 1) / NAV_LANES;
    s.cell_theta = 2.0 * NAV_PI / s.nh;
    return s;
}

static size_t histogram_shape_lines(const struct nav_shape *s)
{
    return (size_t)s->nh * (size_t)s->ny;
}

size_t nav_shape_cells(const struct nav_shape *s)
{
    return histogram_shape_lines(s) * (size_t)s->groups * NAV_LANES;
}

double nav_shape_inside(const struct nav_shape *s)
{
    return (double)s->nx * s->ny * s->nh;
}

static int histogram_cells_init(struct nav_cells *c, const struct nav_shape *finest, uint32_t room)
{
    c->first = calloc(histogram_shape_lines(finest) + 1, sizeof *c->first);
    c->at = calloc(room, sizeof *c->at);
    c->mass = calloc((size_t)room * NAV_LANES, sizeof *c->mass);
    return c->first && c->at && c->mass ? 0 : -1;
}

static void histogram_cells_free(struct nav_cells *c)
{
    free(c->first);
    free(c->at);
    free(c->mass);
}

static int histogram_line_init(struct nav_line *line, const struct nav_shape *finest)
{
    float *cell = calloc((size_t)finest->groups * NAV_LANES + 2 * PAD, sizeof *cell);
    *line = (struct nav_line){cell ? cell + PAD : NULL, INT_MAX, 0};
    return cell ? 0 : -1;
}

static void histogram_line_free(struct nav_line *line)
{
    free(line->cell ? line->cell - PAD : NULL);
}

static int histogram_pass_init(struct nav_histogram *h, const struct nav_shape *finest)
{
    struct nav_pass *p = h->pass = calloc(1, sizeof *p);
    if (!p)
        return -1;
    p->roll_x = calloc((size_t)finest->nh, sizeof *p->roll_x);
    p->roll_y = calloc((size_t)finest->nh, sizeof *p->roll_y);
    int failed = !p->roll_x || !p->roll_y || histogram_line_init(&p->raw, finest);
    for (int n = 0; n < NAV_BLUR_LINES && !failed; n++)
        failed = histogram_line_init(&p->blurred[n], finest);
    return failed ? -1 : 0;
}

int nav_histogram_init(struct nav_histogram *h, const struct nav_levels *levels, int level, size_t spare)
{
    *h = (struct nav_histogram){.levels = *levels};
    struct nav_shape finest = nav_levels_shape(levels, 0), begin = nav_levels_shape(levels, level);
    size_t room = nav_shape_cells(&begin) / NAV_LANES + spare / NAV_LANES;
    if (room > UINT32_MAX / 2 || finest.groups > UINT16_MAX)
        return -1;
    h->room = (uint32_t)room;
    h->shift_x = calloc((size_t)finest.nh, sizeof *h->shift_x);
    h->shift_y = calloc((size_t)finest.nh, sizeof *h->shift_y);
    h->moment = calloc((size_t)finest.nh, sizeof *h->moment);
    if (!h->shift_x || !h->shift_y || !h->moment || histogram_cells_init(&h->now, &finest, h->room) ||
        histogram_cells_init(&h->next, &finest, h->room) || histogram_pass_init(h, &finest))
        return -1;
    nav_histogram_restart(h, level);
    return 0;
}

void nav_histogram_free(struct nav_histogram *h)
{
    if (h->pass) {
        free(h->pass->roll_x);
        free(h->pass->roll_y);
        histogram_line_free(&h->pass->raw);
        for (int n = 0; n < NAV_BLUR_LINES; n++)
            histogram_line_free(&h->pass->blurred[n]);
    }
    free(h->pass);
    free(h->shift_x);
    free(h->shift_y);
    free(h->moment);
    histogram_cells_free(&h->now);
    histogram_cells_free(&h->next);
}

size_t nav_histogram_bytes(const struct nav_histogram *h)
{
    struct nav_shape finest = nav_levels_shape(&h->levels, 0);
    return 2 * h->room * (NAV_LANES * sizeof *h->now.mass + sizeof *h->now.at) +
           2 * histogram_shape_lines(&finest) * sizeof *h->now.first;
}

void nav_histogram_clear(struct nav_histogram *h, int level)
{
    h->level = level;
    h->shape = nav_levels_shape(&h->levels, level);
    h->uniform = false;
    h->pending_position = h->pending_heading = h->total = h->rotation = 0.0;
    memset(h->shift_x, 0, (size_t)h->shape.nh * sizeof *h->shift_x);
    memset(h->shift_y, 0, (size_t)h->shape.nh * sizeof *h->shift_y);
    memset(h->now.first, 0, (histogram_shape_lines(&h->shape) + 1) * sizeof *h->now.first);
    memset(h->moment, 0, (size_t)h->shape.nh * sizeof *h->moment);
}

void nav_histogram_restart(struct nav_histogram *h, int level)
{
    nav_histogram_clear(h, level);
    h->uniform = true;
    h->total = 1.0;
    h->about = (struct nav_pose){0.0, 0.0, 0.0};
    double x = h->shape.nx * h->shape.cell, y = h->shape.ny * h->shape.cell;
    const double even[NAV_MOMENTS] = {1.0, x / 2.0, y / 2.0, x * x / 3.0, x * y / 4.0, y * y / 3.0};
    for (int p = 0; p < h->shape.nh; p++) {
        for (int k = 0; k < NAV_MOMENTS; k++)
            h->moment[p][k] = even[k] / h->shape.nh;
    }
}

static void histogram_store_begin(struct nav_histogram *h)
{
    h->pass->groups = h->next.first[0] = 0;
}

static void histogram_store_swap(struct nav_histogram *h)
{
    struct nav_cells done = h->next;
    h->next = h->now;
    h->now = done;
    h->uniform = false;
}

uint32_t nav_histogram_groups(const struct nav_histogram *h)
{
    return h->now.first[histogram_shape_lines(&h->shape)];
}

/* Stores a line written out, and empties it. */
static void histogram_store_line(struct nav_histogram *h, struct nav_line *line, size_t number)
{
    for (int g = line->begin; g < line->end; g++) {
        if (histogram_group_any(line->cell + g * NAV_LANES))
            histogram_store_group(h, g, line->cell + g * NAV_LANES);
    }
    histogram_end_line(h, number);
    histogram_line_clear(line);
}

float *nav_histogram_write_out(struct nav_histogram *h, float **line)
{
    *line = h->pass->raw.cell;
    memset(h->next.mass, 0, nav_shape_cells(&h->shape) * sizeof *h->next.mass);
    return h->next.mass;
}

/* No group is stored behind where it was read. */
void nav_histogram_take(struct nav_histogram *h)
{
    struct nav_line *line = &h->pass->raw;
    size_t cells = (size_t)h->shape.groups * NAV_LANES;
    histogram_store_begin(h);
    for (size_t n = 0; n < histogram_shape_lines(&h->shape); n++) {
        memcpy(line->cell, h->next.mass + n * cells, cells * sizeof *line->cell);
        histogram_line_widen(line, 0, h->shape.groups);
        histogram_store_line(h, line, n);
    }
    histogram_store_swap(h);
    h->total = 1.0;
}

/* Cells of a line, written out. */
static void histogram_write_out(const struct nav_histogram *h, size_t number, struct nav_line *line)
{
    for (uint32_t n = h->now.first[number]; n < h->now.first[number + 1]; n++) {
        memcpy(line->cell + h->now.at[n] * NAV_LANES, h->now.mass + (size_t)n * NAV_LANES,
               NAV_LANES * sizeof *line->cell);
        histogram_line_widen(line, h->now.at[n], h->now.at[n] + 1);
    }
}

/* Number of the line that holds a pose, and the cell in it; -1 outside. */
static int64_t histogram_line_of(const struct nav_histogram *h, struct nav_pose pose, int *cell)
{
    const struct nav_shape *s = &h->shape;
    double turns = (pose.theta - h->rotation) / (2.0 * NAV_PI);
    int p = (int)((turns - floor(turns)) * s->nh) % s->nh;
    double i = floor((pose.x - h->shift_x[p]) / s->cell), j = floor((pose.y - h->shift_y[p]) / s->cell);
    if (!(i >= 0.0 && j >= 0.0 && i < s->nx && j < s->ny))
        return -1;
    *cell = (int)i;
    return (int64_t)p * s->ny + (int64_t)j;
}

/* The chains of grains by line begin where the store's lines will be numbered: a line is read before it is written. */
void nav_histogram_add(struct nav_histogram *h, struct nav_grain *grain, int32_t count)
{
    struct nav_line *line = &h->pass->raw;
    size_t lines = histogram_shape_lines(&h->shape);
    int cell = 0;
    histogram_store_begin(h);
    memset(h->next.first + 1, 0, lines * sizeof *h->next.first);
    for (int32_t n = 0; n < count; n++) {
        int64_t at = histogram_line_of(h, grain[n].pose, &cell);
        if (at < 0)
            continue;
        grain[n].next = (int32_t)h->next.first[at + 1] - 1;
        h->next.first[at + 1] = (uint32_t)n + 1;
        h->total += grain[n].mass;
        double x = grain[n].pose.x - h->about.x, y = grain[n].pose.y - h->about.y, *m = h->moment[at / h->shape.ny];
        const double parts[NAV_MOMENTS] = {1.0, x, y, x * x, x * y, y * y};
        for (int k = 0; k < NAV_MOMENTS; k++)
            m[k] += grain[n].mass * parts[k];
    }
    for (size_t number = 0; number < lines; number++) {
        histogram_write_out(h, number, line);
        for (int32_t n = (int32_t)h->next.first[number + 1] - 1; n >= 0; n = grain[n].next) {
            histogram_line_of(h, grain[n].pose, &cell);
            line->cell[cell] += (float)grain[n].mass;
            histogram_line_widen(line, cell / NAV_LANES, cell / NAV_LANES + 1);
        }
        histogram_store_line(h, line, number);
    }
    histogram_store_swap(h);
}

/* Writes out the finer line that is half of a line's cells, `dx` cells to the right. */
static void histogram_split_line(const struct nav_histogram *h, size_t number, const struct nav_shape *finer, int dx,
                                 float share, struct nav_line *line)
{
    for (uint32_t n = h->now.first[number]; n < h->now.first[number + 1]; n++) {
        for (int k = 0; k < NAV_LANES; k++) {
            float mass = share * h->now.mass[(size_t)n * NAV_LANES + (size_t)k];
            int at = 2 * (h->now.at[n] * NAV_LANES + k) + dx;
            for (int i = at > 0 ? at : 0; i < at + 2 && i < finer->nx && mass > 0.0f; i++) {
                line->cell[i] = mass;
                histogram_line_widen(line, i / NAV_LANES, i / NAV_LANES + 1);
            }
        }
    }
}

bool nav_histogram_refine(struct nav_histogram *h)
{
    if (h->level == 0 || h->uniform)
        return false;
    struct nav_shape coarse = h->shape, finer = nav_levels_shape(&h->levels, h->level - 1);
    int turns = finer.nh / coarse.nh;
    if ((size_t)nav_histogram_groups(h) * 4u * (size_t)turns * 2u > h->room)
        return false;
    histogram_store_begin(h);
    for (int q = finer.nh - 1; q >= 0; q--) { /* from the last: what is read lies before what is written */
        h->shift_x[q] = h->shift_x[q / turns];
        h->shift_y[q] = h->shift_y[q / turns];
        h->pass->roll_x[q] = histogram_carry(&h->shift_x[q], 0.0, finer.cell, finer.nx);
        h->pass->roll_y[q] = histogram_carry(&h->shift_y[q], 0.0, finer.cell, finer.ny);
        for (int k = 0; k < NAV_MOMENTS; k++)
            h->moment[q][k] = h->moment[q / turns][k] / turns;
    }
    for (int q = 0; q < finer.nh; q++) {
        int p = q / turns, dx = h->pass->roll_x[q], dy = h->pass->roll_y[q];
        for (int j = 0; j < finer.ny; j++) {
            int from = j - dy >= 0 ? (j - dy) / 2 : -1;
            h->shape = coarse;
            if (from >= 0 && from < coarse.ny)
                histogram_split_line(h, (size_t)p * (size_t)coarse.ny + (size_t)from, &finer, dx, 0.25f / (float)turns,
                                     &h->pass->raw);
            h->shape = finer;
            histogram_store_line(h, &h->pass->raw, (size_t)q * (size_t)finer.ny + (size_t)j);
        }
    }
    h->heaviest *= 0.25f / (float)turns;
    h->cells *= 4L * turns;
    h->level--;
    histogram_store_swap(h);
    return true;
}

/* One pass: cells moved, noise added, likelihood applied, sums taken; line by line, so that what is in the making stays
 * in the nearest cache. Sums run in fixed lanes of single precision along a line and in double precision over lines. */

/* Blurring costs work, so variance is saved up to this share of a squared cell edge ... */
static const double PENDING_LEAST = 0.05;
/* ... and no three-point kernel takes more than this (its middle weight stays at 1/2). */
static const double KERNEL_MOST = 0.5;

double nav_histogram_fan(const struct nav_histogram *h, struct nav_pose step, double along_m)
{
    double distance = hypot(step.x, step.y);
    return h->shape.cell_theta * h->shape.cell_theta / 12.0 * distance * fmax(distance, along_m);
}

double nav_histogram_heading(const struct nav_histogram *h, int p)
{
    return (p + 0.5) * h->shape.cell_theta + h->rotation;
}

double nav_histogram_shift_x(const struct nav_histogram *h, int p)
{
    return h->shift_x[p];
}

double nav_histogram_shift_y(const struct nav_histogram *h, int p)
{
    return h->shift_y[p];
}

double nav_histogram_debt(const struct nav_histogram *h)
{
    double cell = h->shape.cell, turn = h->shape.cell_theta;
    return fmax(h->pending_position / (NAV_BLUR_MOST * KERNEL_MOST * cell * cell),
                h->pending_heading / (KERNEL_MOST * turn * turn));
}

/* Takes what is due of a variance, as at most `most` kernels of three points: how many, and their side weight. A kernel
 * with side weight s adds 2 s cell^2. */
static int histogram_pass_due(double *pending, double cell, int most, double *side)
{
    double share = *pending / (cell * cell);
    *side = 0.0;
    if (share < PENDING_LEAST)
        return 0;
    int kernels = (int)fmin(ceil(share / KERNEL_MOST), most);
    double each = fmin(share / kernels, KERNEL_MOST);
    *pending -= each * kernels * cell * cell;
    *side = each / 2.0;
    return kernels;
}

static void histogram_pass_kernels(struct nav_pass *p, double side, double scale)
{
    double kernel[NAV_BLUR_LINES + 2] = {0.0}, wider[NAV_BLUR_LINES + 2];
    kernel[1] = 1.0;
    for (int n = 0; n < p->blur.reach; n++) {
        memcpy(wider, kernel, sizeof wider);
        for (int k = 1; k <= NAV_BLUR_LINES; k++)
            kernel[k] = (1.0 - 2.0 * side) * wider[k - 1] + side * (wider[k] + (k > 1 ? wider[k - 2] : 0.0));
    }
    for (int k = 0; k < NAV_BLUR_LINES; k++) {
        p->blur.along[k] = (float)kernel[k + 1];
        p->blur.across[k] = (float)(scale * kernel[k + 1]);
    }
}

/* Moves slices by their headings: whole cells wait in `roll`. */
static void histogram_pass_shift(struct nav_histogram *h, struct nav_pose step)
{
    struct nav_pass *pass = h->pass;
    for (int p = 0; p < h->shape.nh; p++) {
        double heading = nav_histogram_heading(h, p), c = cos(heading), s = sin(heading);
        pass->roll_x[p] = histogram_carry(&h->shift_x[p], c * step.x - s * step.y, h->shape.cell, h->shape.nx);
        pass->roll_y[p] = histogram_carry(&h->shift_y[p], s * step.x + c * step.y, h->shape.cell, h->shape.ny);
    }
    h->rotation = nav_wrap(h->rotation + step.theta);
}

static void histogram_pass_begin(struct nav_histogram *h, struct nav_pose step, const struct nav_weigh *weigh,
                                 struct nav_pose about)
{
    struct nav_pass *p = h->pass;
    double side, side_turn;
    if (h->uniform) /* nothing blurs what is uniform */
        h->pending_position = h->pending_heading = 0.0;
    p->blur.reach = histogram_pass_due(&h->pending_position, h->shape.cell, NAV_BLUR_MOST, &side);
    histogram_pass_due(&h->pending_heading, h->shape.cell_theta, 1, &side_turn);
    p->blur.side_turn = (float)side_turn;
    histogram_pass_kernels(p, side, 1.0 / h->total);
    histogram_pass_shift(h, step);
    p->weigh = weigh;
    h->about = about;
    p->total = 0.0;
    h->cells = 0;
    h->heaviest = 0.0f;
    p->touched = 0;
    histogram_store_begin(h);
}

static struct nav_line *histogram_pass_blurred(const struct nav_histogram *h, int j)
{
    return &h->pass->blurred[(j + NAV_BLUR_LINES) % NAV_BLUR_LINES];
}

/* Adds a line of slice q, as it was, to line j of the slice; where its cells fall is rounded to whole cells. */
static void histogram_pass_pour(struct nav_histogram *h, int q, int j, float weight)
{
    struct nav_pass *pass = h->pass;
    struct nav_line *out = pass->blur.reach > 0 ? &pass->raw : histogram_pass_blurred(h, j);
    int p = pass->slice, cells = h->shape.nx;
    int dx = pass->roll_x[q] + (int)floor((h->shift_x[q] - h->shift_x[p]) / h->shape.cell + 0.5);
    int dy = pass->roll_y[q] + (int)floor((h->shift_y[q] - h->shift_y[p]) / h->shape.cell + 0.5);
    if (j - dy < 0 || j - dy >= h->shape.ny)
        return;
    const uint32_t *first = h->now.first + (size_t)q * (size_t)h->shape.ny + (size_t)(j - dy);
    for (uint32_t n = first[0]; n < first[1]; n++) {
        int i = h->now.at[n] * NAV_LANES + dx;
        if (i <= -NAV_LANES || i >= cells)
            continue;
        *(nav_lanes *)(out->cell + i) += weight * *(const nav_lanes *)(h->now.mass + (size_t)n * NAV_LANES);
        int group = (i + NAV_LANES) / NAV_LANES - 1, last = (i + 2 * NAV_LANES - 1) / NAV_LANES - 1;
        histogram_line_widen(out, group > 0 ? group : 0, last < h->shape.groups ? last + 1 : h->shape.groups);
        pass->touched += NAV_LANES;
    }
}

/* What is beyond the walls is lost. */
static void histogram_pass_trim(const struct nav_histogram *h, struct nav_line *line)
{
    int end = h->shape.groups * NAV_LANES;
    for (int i = -2 * NAV_LANES; i < 0; i++)
        line->cell[i] = 0.0f;
    for (int i = h->shape.nx; i < end + 2 * NAV_LANES; i++)
        line->cell[i] = 0.0f;
}

/* Blurs the line in `raw` along x and empties it. */
static void histogram_pass_blur(struct nav_histogram *h, struct nav_line *out)
{
    struct nav_pass *pass = h->pass;
    struct nav_line *raw = &pass->raw;
    int reach = pass->blur.reach, begin = raw->begin, end = raw->end;
    for (int k = 0; k < reach; k++) { /* mass this near to the next group reaches it */
        begin -= begin == raw->begin && begin > 0 && raw->cell[raw->begin * NAV_LANES + k] > 0.0f;
        end += end == raw->end && end < h->shape.groups && raw->cell[raw->end * NAV_LANES - 1 - k] > 0.0f;
    }
    histogram_line_widen(out, begin, end);
    for (int g = begin; g < end; g++) {
        nav_lanes sum = {0.0f};
        for (int t = 0; t <= 2 * reach; t++)
            sum += pass->blur.along[t] * *(const nav_lanes *)(raw->cell + g * NAV_LANES + t - reach);
        *(nav_lanes *)(out->cell + g * NAV_LANES) = sum;
        pass->touched += NAV_LANES;
    }
    histogram_pass_trim(h, out);
    histogram_line_clear(raw);
}

/* Writes out the next line of the slice, moved and blurred along x and over headings. */
static void histogram_pass_make(struct nav_histogram *h)
{
    struct nav_pass *pass = h->pass;
    int p = pass->slice, nh = h->shape.nh, j = pass->made++;
    struct nav_line *out = histogram_pass_blurred(h, j);
    histogram_line_clear(out);
    if (j < 0 || j >= h->shape.ny)
        return;
    long before = pass->touched;
    histogram_pass_pour(h, p, j, 1.0f - 2.0f * pass->blur.side_turn);
    if (pass->blur.side_turn > 0.0f) {
        histogram_pass_pour(h, (p + 1) % nh, j, pass->blur.side_turn);
        histogram_pass_pour(h, (p + nh - 1) % nh, j, pass->blur.side_turn);
    }
    if (pass->touched == before)
        return;
    histogram_pass_trim(h, pass->blur.reach > 0 ? &pass->raw : out);
    if (pass->blur.reach > 0)
        histogram_pass_blur(h, out);
}

/* Widens `extent` by the lines of slice p that hold mass, where they will be. */
static void histogram_pass_widen(const struct nav_histogram *h, int p, int by, int extent[2])
{
    const uint32_t *first = h->now.first + (size_t)p * (size_t)h->shape.ny;
    int low = 0, high = h->shape.ny;
    if (first[low] == first[high])
        return;
    while (first[low + 1] == first[low])
        low++;
    while (first[high - 1] == first[high])
        high--;
    low += h->pass->roll_y[p] - by;
    high += h->pass->roll_y[p] + by;
    extent[0] = low < extent[0] ? low : extent[0];
    extent[1] = high > extent[1] ? high : extent[1];
}

static bool histogram_pass_everywhere(const struct nav_histogram *h)
{
    return h->uniform || h->pass->weigh->extra > 0.0;
}

/* Lines of the slice that may hold mass after the pass: those before and behind hold none. */
static void histogram_pass_extent(const struct nav_histogram *h, int extent[2])
{
    const struct nav_pass *p = h->pass;
    int nh = h->shape.nh;
    extent[0] = histogram_pass_everywhere(h) ? 0 : h->shape.ny;
    extent[1] = histogram_pass_everywhere(h) ? h->shape.ny : 0;
    histogram_pass_widen(h, p->slice, p->blur.reach, extent);
    for (int k = -1; k <= 1 && p->blur.side_turn > 0.0f; k += 2) /* another's shift differs by less than two cells */
        histogram_pass_widen(h, (p->slice + nh + k) % nh, p->blur.reach + 2, extent);
    extent[0] = extent[0] > 0 ? extent[0] : 0;
    extent[1] = extent[1] < h->shape.ny ? extent[1] : h->shape.ny;
}

/* Finds the groups begin .. end - 1 of the line that may hold mass. */
static struct nav_line histogram_pass_open(struct nav_histogram *h)
{
    struct nav_pass *p = h->pass;
    struct nav_line all = {NULL, h->shape.groups, 0};
    for (int t = 0; t <= 2 * p->blur.reach && !h->uniform; t++) {
        const struct nav_line *from = histogram_pass_blurred(h, p->line + t - p->blur.reach);
        p->row[t] = from->cell;
        histogram_line_widen(&all, from->begin, from->end);
    }
    if (histogram_pass_everywhere(h))
        histogram_line_widen(&all, 0, h->shape.groups);
    p->sums = (struct nav_line_sums){.cells = {0}};
    return all;
}

/* What is added to a cell of the line. */
static float histogram_pass_extra(const struct nav_histogram *h, int column)
{
    const struct nav_pass *p = h->pass;
    if (!(p->weigh->extra > 0.0) || !p->weigh->prior)
        return (float)p->weigh->extra;
    double x = (column + 0.5) * h->shape.cell + nav_histogram_shift_x(h, p->slice);
    double y = (p->line + 0.5) * h->shape.cell + nav_histogram_shift_y(h, p->slice);
    return (float)(p->weigh->extra * p->weigh->prior(p->weigh->self, x, y));
}

/* Mass of a group before it is weighed. */
static void histogram_pass_mass(const struct nav_histogram *h, int g, float *mass)
{
    const struct nav_pass *p = h->pass;
    float even = h->uniform ? (float)(1.0 / nav_shape_inside(&h->shape)) : 0.0f;
    nav_lanes sum = {0.0f};
    for (int t = 0; t <= 2 * p->blur.reach && !h->uniform; t++)
        sum += p->blur.across[t] * *(const nav_lanes *)(p->row[t] + g * NAV_LANES);
    int inside = h->shape.nx - g * NAV_LANES;
    float least = (float)p->weigh->least;
    for (int k = 0; k < NAV_LANES; k++) {
        float all = sum[k] + (k < inside ? even + histogram_pass_extra(h, g * NAV_LANES + k) : 0.0f);
        mass[k] = all >= least ? all : 0.0f;
    }
}

/* Adds a group to the line's sums and to the store. */
static void histogram_pass_take(struct nav_histogram *h, int g, const float *mass)
{
    struct nav_pass *p = h->pass;
    struct nav_line_sums *sums = &p->sums;
    float x = (float)(g * NAV_LANES * h->shape.cell + h->shift_x[p->slice] - h->about.x);
    nav_lanes held = *(const nav_lanes *)mass, middle;
    for (int k = 0; k < NAV_LANES; k++)
        middle[k] = (float)k + 0.5f;
    nav_lanes at = (float)h->shape.cell * middle + x;
    sums->mass[0] += held;
    sums->mass[1] += held * at;
    sums->mass[2] += held * at * at;
    for (int k = 0; k < NAV_LANES; k++)
        sums->peak[k] = mass[k] > sums->peak[k] ? mass[k] : sums->peak[k];
    sums->cells -= held > 0.0f;
    histogram_store_group(h, g, mass);
}

static void histogram_pass_group(struct nav_histogram *h, int g)
{
    struct nav_pass *p = h->pass;
    float mass[NAV_LANES], like[NAV_LANES];
    histogram_pass_mass(h, g, mass);
    p->touched += NAV_LANES;
    if (!histogram_group_any(mass))
        return;
    if (p->weigh->group) {
        p->touched += p->weigh->group(p->weigh->self, p->slice, p->line, g, mass, like);
        for (int k = 0; k < NAV_LANES; k++)
            mass[k] *= like[k];
    }
    if (histogram_group_any(mass))
        histogram_pass_take(h, g, mass);
}

/* Finds the heaviest cell of the line's groups, and counts those with mass. */
static void histogram_pass_survey(struct nav_histogram *h, uint32_t first)
{
    struct nav_pass *p = h->pass;
    const float *mass = h->next.mass;
    float peak = 0.0f;
    for (int k = 0; k < NAV_LANES; k++) {
        peak = fmaxf(peak, p->sums.peak[k]);
        h->cells += p->sums.cells[k];
    }
    if (peak <= h->heaviest)
        return;
    size_t n = (size_t)first * NAV_LANES;
    while (n + 1 < (size_t)p->groups * NAV_LANES && mass[n] < peak)
        n++;
    int i = h->next.at[n / NAV_LANES] * NAV_LANES + (int)(n % NAV_LANES);
    h->heaviest = peak;
    h->mode = (struct nav_pose){(i + 0.5) * h->shape.cell + h->shift_x[p->slice],
                                (p->line + 0.5) * h->shape.cell + h->shift_y[p->slice],
                                nav_wrap(nav_histogram_heading(h, p->slice))};
}

/* The line's sums go to the slice's. */
static void histogram_pass_close(struct nav_histogram *h, uint32_t first)
{
    struct nav_pass *p = h->pass;
    double sum[3] = {0.0}, *m = h->moment[p->slice];
    double y = (p->line + 0.5) * h->shape.cell + h->shift_y[p->slice] - h->about.y;
    for (int k = 0; k < 3; k++) {
        for (int n = 0; n < NAV_LANES; n++)
            sum[k] += (double)p->sums.mass[k][n];
    }
    const double parts[NAV_MOMENTS] = {sum[0], sum[1], sum[0] * y, sum[2], sum[1] * y, sum[0] * y * y};
    for (int k = 0; k < NAV_MOMENTS; k++)
        m[k] += parts[k];
    p->total += sum[0];
    histogram_pass_survey(h, first);
}

static void histogram_pass_line(struct nav_histogram *h)
{
    struct nav_pass *p = h->pass;
    uint32_t first = p->groups;
    while (!h->uniform && p->made <= p->line + p->blur.reach)
        histogram_pass_make(h);
    struct nav_line groups = histogram_pass_open(h);
    for (int g = groups.begin; g < groups.end; g++)
        histogram_pass_group(h, g);
    histogram_pass_close(h, first);
}

static void histogram_pass_slice(struct nav_histogram *h)
{
    struct nav_pass *p = h->pass;
    int extent[2];
    memset(h->moment[p->slice], 0, sizeof h->moment[p->slice]);
    histogram_pass_extent(h, extent);
    for (int n = 0; n < NAV_BLUR_LINES; n++)
        histogram_line_clear(&p->blurred[n]);
    p->made = extent[0] - p->blur.reach;
    for (p->line = 0; p->line < h->shape.ny; p->line++) {
        if (p->line >= extent[0] && p->line < extent[1])
            histogram_pass_line(h);
        histogram_end_line(h, (size_t)p->slice * (size_t)h->shape.ny + (size_t)p->line);
    }
}

long nav_histogram_pass(struct nav_histogram *h, struct nav_pose step, const struct nav_weigh *weigh,
                        struct nav_pose about)
{
    struct nav_pass *p = h->pass;
    histogram_pass_begin(h, step, weigh, about);
    for (p->slice = 0; p->slice < h->shape.nh; p->slice++)
        histogram_pass_slice(h);
    h->total = p->total;
    histogram_store_swap(h);
    return p->touched;
}
