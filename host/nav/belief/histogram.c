#include "histogram.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "histogram_pass.h"

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
    c->shift_x = calloc((size_t)finest->nh, sizeof *c->shift_x);
    c->shift_y = calloc((size_t)finest->nh, sizeof *c->shift_y);
    c->first = calloc(histogram_shape_lines(finest) + 1, sizeof *c->first);
    c->at = calloc(room, sizeof *c->at);
    c->mass = calloc((size_t)room * NAV_LANES, sizeof *c->mass);
    return c->shift_x && c->shift_y && c->first && c->at && c->mass ? 0 : -1;
}

static void histogram_cells_free(struct nav_cells *c)
{
    free(c->shift_x);
    free(c->shift_y);
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
    h->moment = calloc((size_t)finest.nh, sizeof *h->moment);
    if (!h->moment || histogram_cells_init(&h->now, &finest, h->room) ||
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
    h->pass->running = h->uniform = false;
    h->owed_position = h->owed_heading = h->total = h->now.rotation = 0.0;
    memset(h->now.shift_x, 0, (size_t)h->shape.nh * sizeof *h->now.shift_x);
    memset(h->now.shift_y, 0, (size_t)h->shape.nh * sizeof *h->now.shift_y);
    memset(h->now.first, 0, (histogram_shape_lines(&h->shape) + 1) * sizeof *h->now.first);
    memset(h->moment, 0, (size_t)h->shape.nh * sizeof *h->moment);
}

void nav_histogram_restart(struct nav_histogram *h, int level)
{
    nav_histogram_clear(h, level);
    h->uniform = true;
    h->total = 1.0;
}

void nav_store_begin(struct nav_histogram *h)
{
    h->pass->at.groups = h->next.first[0] = 0;
}

void nav_store_swap(struct nav_histogram *h)
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

static void histogram_copy_place(struct nav_histogram *h)
{
    h->next.rotation = h->now.rotation;
    memcpy(h->next.shift_x, h->now.shift_x, (size_t)h->shape.nh * sizeof *h->now.shift_x);
    memcpy(h->next.shift_y, h->now.shift_y, (size_t)h->shape.nh * sizeof *h->now.shift_y);
}

/* Stores a line written out, and empties it. */
static void histogram_store_line(struct nav_histogram *h, struct nav_line *line, size_t number)
{
    for (int g = line->begin; g < line->end; g++) {
        if (nav_group_any(line->cell + g * NAV_LANES))
            nav_store_group(h, g, line->cell + g * NAV_LANES);
    }
    nav_store_end_line(h, number);
    nav_line_clear(line);
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
    histogram_copy_place(h);
    nav_store_begin(h);
    for (size_t n = 0; n < histogram_shape_lines(&h->shape); n++) {
        memcpy(line->cell, h->next.mass + n * cells, cells * sizeof *line->cell);
        nav_line_widen(line, 0, h->shape.groups);
        histogram_store_line(h, line, n);
    }
    nav_store_swap(h);
    h->total = 1.0;
}

/* Cells of a line, written out. */
static void histogram_write_out(const struct nav_histogram *h, size_t number, struct nav_line *line)
{
    for (uint32_t n = h->now.first[number]; n < h->now.first[number + 1]; n++) {
        memcpy(line->cell + h->now.at[n] * NAV_LANES, h->now.mass + (size_t)n * NAV_LANES,
               NAV_LANES * sizeof *line->cell);
        nav_line_widen(line, h->now.at[n], h->now.at[n] + 1);
    }
}

/* Number of the line that holds a pose, and the cell in it; -1 outside. */
static int64_t histogram_line_of(const struct nav_histogram *h, struct nav_pose pose, int *cell)
{
    const struct nav_shape *s = &h->shape;
    double turns = (pose.theta - h->now.rotation) / (2.0 * NAV_PI);
    int p = (int)((turns - floor(turns)) * s->nh) % s->nh;
    double i = floor((pose.x - h->now.shift_x[p]) / s->cell), j = floor((pose.y - h->now.shift_y[p]) / s->cell);
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
    histogram_copy_place(h);
    nav_store_begin(h);
    memset(h->next.first + 1, 0, lines * sizeof *h->next.first);
    for (int32_t n = 0; n < count; n++) {
        int64_t at = histogram_line_of(h, grain[n].pose, &cell);
        if (at < 0)
            continue;
        grain[n].next = (int32_t)h->next.first[at + 1] - 1;
        h->next.first[at + 1] = (uint32_t)n + 1;
        h->total += grain[n].mass;
    }
    for (size_t number = 0; number < lines; number++) {
        histogram_write_out(h, number, line);
        for (int32_t n = (int32_t)h->next.first[number + 1] - 1; n >= 0; n = grain[n].next) {
            histogram_line_of(h, grain[n].pose, &cell);
            line->cell[cell] += (float)grain[n].mass;
            nav_line_widen(line, cell / NAV_LANES, cell / NAV_LANES + 1);
        }
        histogram_store_line(h, line, number);
    }
    nav_store_swap(h);
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
                nav_line_widen(line, i / NAV_LANES, i / NAV_LANES + 1);
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
    nav_store_begin(h);
    h->next.rotation = h->now.rotation;
    for (int q = 0; q < finer.nh; q++) {
        int p = q / turns, dx, dy;
        h->next.shift_x[q] = h->next.shift_y[q] = 0.0;
        dx = nav_histogram_carry(&h->next.shift_x[q], h->now.shift_x[p], finer.cell, finer.nx);
        dy = nav_histogram_carry(&h->next.shift_y[q], h->now.shift_y[p], finer.cell, finer.ny);
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
    for (int q = finer.nh; q-- > 0;) {
        for (int k = 0; k < NAV_MOMENTS; k++)
            h->moment[q][k] = h->moment[q / turns][k] / turns;
    }
    h->heaviest *= 0.25f / (float)turns;
    h->cells *= 4L * turns;
    h->level--;
    nav_store_swap(h);
    return true;
}
