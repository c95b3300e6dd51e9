/* One pass: cells moved, noise added, likelihood applied, sums taken; line by line, so that what is in the making stays
 * in the nearest cache. Sums run in fixed lanes of single precision along a line and in double precision over lines. */
#include "histogram_pass.h"

#include <math.h>

/* Blurring costs work, so variance is saved up to this share of a squared cell edge ... */
static const double OWED_LEAST = 0.05;
/* ... and no three-point kernel takes more than this (its middle weight stays at 1/2). */
static const double KERNEL_MOST = 0.5;

/* Lines passed over to write one out: its own, those of both neighbours, the blurred one. */
enum { MAKE_MOST = 4 };

int nav_histogram_carry(double *shift, double by, double cell, int most)
{
    double whole = floor((*shift + by) / cell + 0.5);
    *shift += by - whole * cell;
    return (int)fmax(fmin(whole, most), -most);
}

double nav_histogram_fan(const struct nav_histogram *h, struct nav_pose step, double along_m)
{
    double distance = hypot(step.x, step.y);
    return h->shape.cell_theta * h->shape.cell_theta / 12.0 * distance * fmax(distance, along_m);
}

/* Store that the shifts are taken from. */
static const struct nav_cells *pass_cells(const struct nav_histogram *h)
{
    return h->pass->running ? &h->next : &h->now;
}

double nav_histogram_heading(const struct nav_histogram *h, int p)
{
    return (p + 0.5) * h->shape.cell_theta + pass_cells(h)->rotation;
}

double nav_histogram_shift_x(const struct nav_histogram *h, int p)
{
    return pass_cells(h)->shift_x[p];
}

double nav_histogram_shift_y(const struct nav_histogram *h, int p)
{
    return pass_cells(h)->shift_y[p];
}

bool nav_histogram_running(const struct nav_histogram *h)
{
    return h->pass->running;
}

double nav_histogram_debt(const struct nav_histogram *h)
{
    double cell = h->shape.cell, turn = h->shape.cell_theta;
    return fmax(h->owed_position / (NAV_BLUR_MOST * KERNEL_MOST * cell * cell),
                h->owed_heading / (KERNEL_MOST * turn * turn));
}

/* Takes what is due of a variance, as at most `most` kernels of three points: how many, and their side weight. A kernel
 * with side weight s adds 2 s cell^2. */
static int pass_due(double *pending, double cell, int most, double *side)
{
    double share = *pending / (cell * cell);
    *side = 0.0;
    if (share < OWED_LEAST)
        return 0;
    int kernels = (int)fmin(ceil(share / KERNEL_MOST), most);
    double each = fmin(share / kernels, KERNEL_MOST);
    *pending -= each * kernels * cell * cell;
    *side = each / 2.0;
    return kernels;
}

static void pass_kernels(struct nav_pass *p, double side, double scale)
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
static void pass_shift(struct nav_histogram *h, struct nav_pose step)
{
    struct nav_pass *pass = h->pass;
    for (int p = 0; p < h->shape.nh; p++) {
        double heading = (p + 0.5) * h->shape.cell_theta + h->now.rotation, c = cos(heading), s = sin(heading);
        h->next.shift_x[p] = h->now.shift_x[p];
        h->next.shift_y[p] = h->now.shift_y[p];
        pass->roll_x[p] = nav_histogram_carry(&h->next.shift_x[p], c * step.x - s * step.y, h->shape.cell, h->shape.nx);
        pass->roll_y[p] = nav_histogram_carry(&h->next.shift_y[p], s * step.x + c * step.y, h->shape.cell, h->shape.ny);
    }
    h->next.rotation = nav_wrap(h->now.rotation + step.theta);
}

static void pass_begin_slice(struct nav_histogram *h);

void nav_histogram_begin(struct nav_histogram *h, struct nav_pose step, const struct nav_weigh *weigh,
                         struct nav_pose about)
{
    struct nav_pass *p = h->pass;
    double side, side_turn;
    if (h->uniform) /* nothing blurs what is uniform */
        h->owed_position = h->owed_heading = 0.0;
    p->blur.reach = pass_due(&h->owed_position, h->shape.cell, NAV_BLUR_MOST, &side);
    pass_due(&h->owed_heading, h->shape.cell_theta, 1, &side_turn);
    p->blur.side_turn = (float)side_turn;
    pass_kernels(p, side, 1.0 / h->total);
    pass_shift(h, step);
    p->weigh = weigh;
    p->about = about;
    p->total = 0.0;
    p->cells = 0;
    p->heaviest = 0.0f;
    p->at.slice = 0;
    p->running = true;
    nav_store_begin(h);
    pass_begin_slice(h);
}

static struct nav_line *pass_blurred(const struct nav_histogram *h, int j)
{
    return &h->pass->blurred[(j + NAV_BLUR_LINES) % NAV_BLUR_LINES];
}

/* Adds a line of slice q, as it was, to line j of the slice; where its cells fall is rounded to whole cells. */
static void pass_pour(struct nav_histogram *h, int q, int j, float weight)
{
    struct nav_pass *pass = h->pass;
    struct nav_line *out = pass->blur.reach > 0 ? &pass->raw : pass_blurred(h, j);
    int p = pass->at.slice, cells = h->shape.nx;
    int dx = pass->roll_x[q] + (int)floor((h->next.shift_x[q] - h->next.shift_x[p]) / h->shape.cell + 0.5);
    int dy = pass->roll_y[q] + (int)floor((h->next.shift_y[q] - h->next.shift_y[p]) / h->shape.cell + 0.5);
    if (j - dy < 0 || j - dy >= h->shape.ny)
        return;
    const uint32_t *first = h->now.first + (size_t)q * (size_t)h->shape.ny + (size_t)(j - dy);
    for (uint32_t n = first[0]; n < first[1]; n++) {
        int i = h->now.at[n] * NAV_LANES + dx;
        if (i <= -NAV_LANES || i >= cells)
            continue;
        *(nav_lanes *)(out->cell + i) += weight * *(const nav_lanes *)(h->now.mass + (size_t)n * NAV_LANES);
        int group = (i + NAV_LANES) / NAV_LANES - 1, last = (i + 2 * NAV_LANES - 1) / NAV_LANES - 1;
        nav_line_widen(out, group > 0 ? group : 0, last < h->shape.groups ? last + 1 : h->shape.groups);
        pass->at.touched += NAV_LANES;
    }
}

/* What is beyond the walls is lost. */
static void pass_trim(const struct nav_histogram *h, struct nav_line *line)
{
    int end = h->shape.groups * NAV_LANES;
    for (int i = -2 * NAV_LANES; i < 0; i++)
        line->cell[i] = 0.0f;
    for (int i = h->shape.nx; i < end + 2 * NAV_LANES; i++)
        line->cell[i] = 0.0f;
}

/* Blurs the line in `raw` along x and empties it. */
static void pass_blur(struct nav_histogram *h, struct nav_line *out)
{
    struct nav_pass *pass = h->pass;
    struct nav_line *raw = &pass->raw;
    int reach = pass->blur.reach, begin = raw->begin, end = raw->end;
    for (int k = 0; k < reach; k++) { /* mass this near to the next group reaches it */
        begin -= begin == raw->begin && begin > 0 && raw->cell[raw->begin * NAV_LANES + k] > 0.0f;
        end += end == raw->end && end < h->shape.groups && raw->cell[raw->end * NAV_LANES - 1 - k] > 0.0f;
    }
    nav_line_widen(out, begin, end);
    for (int g = begin; g < end; g++) {
        nav_lanes sum = {0.0f};
        for (int t = 0; t <= 2 * reach; t++)
            sum += pass->blur.along[t] * *(const nav_lanes *)(raw->cell + g * NAV_LANES + t - reach);
        *(nav_lanes *)(out->cell + g * NAV_LANES) = sum;
        pass->at.touched += NAV_LANES;
    }
    pass_trim(h, out);
    nav_line_clear(raw);
}

/* Writes out the next line of the slice, moved and blurred along x and over headings. */
static void pass_make(struct nav_histogram *h)
{
    struct nav_pass *pass = h->pass;
    int p = pass->at.slice, nh = h->shape.nh, j = pass->at.made++;
    struct nav_line *out = pass_blurred(h, j);
    nav_line_clear(out);
    if (j < 0 || j >= h->shape.ny)
        return;
    long before = pass->at.touched;
    pass_pour(h, p, j, 1.0f - 2.0f * pass->blur.side_turn);
    if (pass->blur.side_turn > 0.0f) {
        pass_pour(h, (p + 1) % nh, j, pass->blur.side_turn);
        pass_pour(h, (p + nh - 1) % nh, j, pass->blur.side_turn);
    }
    if (pass->at.touched == before)
        return;
    pass_trim(h, pass->blur.reach > 0 ? &pass->raw : out);
    if (pass->blur.reach > 0)
        pass_blur(h, out);
}

/* Widens `extent` by the lines of slice p that hold mass, where they will be. */
static void pass_widen(const struct nav_histogram *h, int p, int by, int extent[2])
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

static bool pass_everywhere(const struct nav_histogram *h)
{
    return h->uniform || h->pass->weigh->extra > 0.0;
}

/* Lines of the slice that may hold mass after the pass: those before and behind hold none. */
static void pass_extent(const struct nav_histogram *h, int extent[2])
{
    const struct nav_pass *p = h->pass;
    int nh = h->shape.nh;
    extent[0] = pass_everywhere(h) ? 0 : h->shape.ny;
    extent[1] = pass_everywhere(h) ? h->shape.ny : 0;
    pass_widen(h, p->at.slice, p->blur.reach, extent);
    for (int k = -1; k <= 1 && p->blur.side_turn > 0.0f; k += 2) /* another's shift differs by less than two cells */
        pass_widen(h, (p->at.slice + nh + k) % nh, p->blur.reach + 2, extent);
    extent[0] = extent[0] > 0 ? extent[0] : 0;
    extent[1] = extent[1] < h->shape.ny ? extent[1] : h->shape.ny;
}

/* Stores lines of the slice before `end` as empty. */
static void pass_skip(struct nav_histogram *h, int end)
{
    struct nav_pass *p = h->pass;
    for (; p->at.line < end; p->at.line++)
        nav_store_end_line(h, (size_t)p->at.slice * (size_t)h->shape.ny + (size_t)p->at.line);
}

static void pass_begin_slice(struct nav_histogram *h)
{
    struct nav_pass *p = h->pass;
    int extent[2];
    memset(h->moment[p->at.slice], 0, sizeof h->moment[p->at.slice]);
    pass_extent(h, extent);
    p->at.line = 0;
    p->at.end = extent[1];
    p->at.group = -1;
    pass_skip(h, extent[0] < extent[1] ? extent[0] : h->shape.ny);
    for (int n = 0; n < NAV_BLUR_LINES && p->at.line < h->shape.ny; n++)
        nav_line_clear(&p->blurred[n]);
    p->at.made = p->at.line - p->blur.reach;
}

/* Finds the groups of the line that may hold mass. */
static void pass_open(struct nav_histogram *h)
{
    struct nav_pass *p = h->pass;
    struct nav_line all = {NULL, h->shape.groups, 0};
    for (int t = 0; t <= 2 * p->blur.reach && !h->uniform; t++) {
        const struct nav_line *from = pass_blurred(h, p->at.line + t - p->blur.reach);
        p->row[t] = from->cell;
        nav_line_widen(&all, from->begin, from->end);
    }
    if (pass_everywhere(h))
        nav_line_widen(&all, 0, h->shape.groups);
    p->sums = (struct nav_line_sums){.cells = {0}};
    p->at.group = all.begin;
    p->groups_end = all.end;
}

/* Mass of a group before it is weighed. */
static void pass_mass(const struct nav_histogram *h, int g, float *mass)
{
    const struct nav_pass *p = h->pass;
    float same = (float)(p->weigh->extra + (h->uniform ? 1.0 / nav_shape_inside(&h->shape) : 0.0));
    nav_lanes sum = {0.0f};
    for (int t = 0; t <= 2 * p->blur.reach && !h->uniform; t++)
        sum += p->blur.across[t] * *(const nav_lanes *)(p->row[t] + g * NAV_LANES);
    int inside = h->shape.nx - g * NAV_LANES;
    float least = (float)p->weigh->least;
    for (int k = 0; k < NAV_LANES; k++) {
        float all = sum[k] + (k < inside ? same : 0.0f);
        mass[k] = all >= least ? all : 0.0f;
    }
}

/* Adds a group to the line's sums and to the store. */
static void pass_take(struct nav_histogram *h, int g, const float *mass)
{
    static const nav_lanes STEPS = {0.5f, 1.5f, 2.5f, 3.5f, 4.5f, 5.5f, 6.5f, 7.5f};
    struct nav_pass *p = h->pass;
    struct nav_line_sums *sums = &p->sums;
    float x = (float)(g * NAV_LANES * h->shape.cell + h->next.shift_x[p->at.slice] - p->about.x);
    nav_lanes held = *(const nav_lanes *)mass, at = (float)h->shape.cell * STEPS + x;
    sums->mass[0] += held;
    sums->mass[1] += held * at;
    sums->mass[2] += held * at * at;
    for (int k = 0; k < NAV_LANES; k++)
        sums->peak[k] = mass[k] > sums->peak[k] ? mass[k] : sums->peak[k];
    sums->cells -= held > 0.0f;
    nav_store_group(h, g, mass);
}

static void pass_group(struct nav_histogram *h, int g)
{
    struct nav_pass *p = h->pass;
    float mass[NAV_LANES], like[NAV_LANES];
    pass_mass(h, g, mass);
    p->at.touched += NAV_LANES;
    if (!nav_group_any(mass))
        return;
    if (p->weigh->group) {
        p->at.touched += p->weigh->group(p->weigh->self, p->at.slice, p->at.line, g, mass, like);
        for (int k = 0; k < NAV_LANES; k++)
            mass[k] *= like[k];
    }
    if (nav_group_any(mass))
        pass_take(h, g, mass);
}

/* Finds the heaviest cell of the line's groups, and counts those with mass. */
static void pass_survey(struct nav_histogram *h, uint32_t first)
{
    struct nav_pass *p = h->pass;
    const float *mass = h->next.mass;
    float peak = 0.0f;
    for (int k = 0; k < NAV_LANES; k++) {
        peak = fmaxf(peak, p->sums.peak[k]);
        p->cells += p->sums.cells[k];
    }
    if (peak <= p->heaviest)
        return;
    size_t n = (size_t)first * NAV_LANES;
    while (n + 1 < (size_t)p->at.groups * NAV_LANES && mass[n] < peak)
        n++;
    int i = h->next.at[n / NAV_LANES] * NAV_LANES + (int)(n % NAV_LANES);
    p->heaviest = peak;
    p->mode = (struct nav_pose){(i + 0.5) * h->shape.cell + h->next.shift_x[p->at.slice],
                                (p->at.line + 0.5) * h->shape.cell + h->next.shift_y[p->at.slice],
                                nav_wrap(nav_histogram_heading(h, p->at.slice))};
}

/* Ends a line: its sums go to the slice's. */
static void pass_close(struct nav_histogram *h)
{
    struct nav_pass *p = h->pass;
    size_t number = (size_t)p->at.slice * (size_t)h->shape.ny + (size_t)p->at.line;
    double sum[3] = {0.0}, *m = h->moment[p->at.slice];
    double y = (p->at.line + 0.5) * h->shape.cell + h->next.shift_y[p->at.slice] - p->about.y;
    for (int k = 0; k < 3; k++) {
        for (int n = 0; n < NAV_LANES; n++)
            sum[k] += (double)p->sums.mass[k][n];
    }
    const double parts[NAV_MOMENTS] = {sum[0], sum[1], sum[0] * y, sum[2], sum[1] * y, sum[0] * y * y};
    for (int k = 0; k < NAV_MOMENTS; k++)
        m[k] += parts[k];
    p->total += sum[0];
    pass_survey(h, h->next.first[number]);
    nav_store_end_line(h, number);
    p->at.line++;
    p->at.group = -1;
}

/* Does groups of the line in work; false: the next one would take more than `most`. */
static bool pass_line(struct nav_histogram *h, long most)
{
    struct nav_pass *p = h->pass;
    long each = NAV_LANES + p->weigh->most;
    for (; !h->uniform && p->at.made <= p->at.line + p->blur.reach; pass_make(h)) {
        if (p->at.touched + MAKE_MOST * NAV_LANES * h->shape.groups > most)
            return false;
    }
    if (p->at.group < 0)
        pass_open(h);
    for (; p->at.group < p->groups_end; p->at.group++) {
        if (p->at.touched + each > most)
            return false;
        pass_group(h, p->at.group);
    }
    pass_close(h);
    return true;
}

static void pass_end(struct nav_histogram *h)
{
    struct nav_pass *p = h->pass;
    p->running = false;
    h->total = p->total;
    h->cells = p->cells;
    h->about = p->about;
    h->heaviest = p->heaviest;
    h->mode = p->mode;
    nav_store_swap(h);
}

long nav_histogram_run(struct nav_histogram *h, long most)
{
    struct nav_pass *p = h->pass;
    p->at.touched = 0;
    while (p->running && (p->at.line == h->shape.ny || pass_line(h, most))) {
        if (p->at.line < p->at.end)
            continue;
        pass_skip(h, h->shape.ny);
        if (++p->at.slice < h->shape.nh)
            pass_begin_slice(h);
        else
            pass_end(h);
    }
    return p->at.touched;
}
