/* What a histogram amounts to: the mass near a pose, its Gaussian, its cells one by one, poses drawn from it. */
#include <math.h>
#include <string.h>

#include "histogram.h"
#include "problem.h"

/* Cells of a slice and a line with their mass. */
struct visit {
    const struct nav_histogram *h;
    void (*take)(void *, struct nav_pose, double mass);
    void *self;
};

static void histogram_visit_line(const struct visit *v, int p, int j)
{
    const struct nav_histogram *h = v->h;
    size_t line = (size_t)p * (size_t)h->shape.ny + (size_t)j;
    double cell = h->shape.cell, each = h->total / nav_shape_inside(&h->shape);
    struct nav_pose at = {0.0, (j + 0.5) * cell + h->shift_y[p], nav_wrap(nav_histogram_heading(h, p))};
    for (int i = 0; i < h->shape.nx && h->uniform; i++) {
        at.x = (i + 0.5) * cell + h->shift_x[p];
        v->take(v->self, at, each);
    }
    for (uint32_t n = h->now.first[line]; n < h->now.first[line + 1] && !h->uniform; n++) {
        for (int k = 0; k < NAV_LANES; k++) {
            double mass = (double)h->now.mass[(size_t)n * NAV_LANES + (size_t)k];
            at.x = (h->now.at[n] * NAV_LANES + k + 0.5) * cell + h->shift_x[p];
            if (mass > 0.0)
                v->take(v->self, at, mass);
        }
    }
}

void nav_histogram_each(const struct nav_histogram *h, void (*take)(void *, struct nav_pose, double), void *self)
{
    const struct visit v = {h, take, self};
    for (int p = 0; p < h->shape.nh; p++) {
        for (int j = 0; j < h->shape.ny; j++)
            histogram_visit_line(&v, p, j);
    }
}

struct listing {
    struct nav_component each, *out;
    struct nav_pose step;
    double scale;
    long count, room;
};

static void histogram_list_take(void *self, struct nav_pose at, double mass)
{
    struct listing *l = self;
    l->each.pose = nav_compose(at, l->step);
    l->each.mass = l->scale * mass;
    if (l->count < l->room)
        l->out[l->count] = l->each;
    l->count++;
}

/* One cell as a component, but for pose and mass. */
static struct nav_component histogram_kernel(const struct nav_histogram *h, const struct nav_pending *pending)
{
    double cell = h->shape.cell, turn = h->shape.cell_theta;
    return (struct nav_component){.sigma_m = sqrt(cell * cell / 12.0 + h->pending_position + pending->noise.position),
                                  .sigma_rad = sqrt(turn * turn / 12.0 + h->pending_heading + pending->noise.heading)};
}

long nav_histogram_components(const struct nav_histogram *h, const struct nav_pending *pending, double mass,
                              struct nav_component *out, long room)
{
    struct listing l = {.out = out, .step = pending->step, .scale = mass / h->total, .room = room};
    l.each = histogram_kernel(h, pending);
    nav_histogram_each(h, histogram_list_take, &l);
    return l.count;
}

/* Mass near a pose, and its offsets from that times mass. */
struct near {
    struct nav_pose pose;
    double turn; /* of the slice from there */
    double mass, x, y, theta;
};

static void histogram_near_take(void *self, struct nav_pose at, double mass)
{
    struct near *near = self;
    double x = at.x - near->pose.x, y = at.y - near->pose.y;
    if (x * x + y * y > NAV_NEAR_M * NAV_NEAR_M)
        return;
    near->mass += mass;
    near->x += mass * x;
    near->y += mass * y;
    near->theta += mass * near->turn;
}

double nav_histogram_near(const struct nav_histogram *h, struct nav_pose pose, struct nav_pose *mean)
{
    struct near near = {.pose = pose};
    const struct visit v = {h, histogram_near_take, &near};
    for (int p = 0; p < h->shape.nh; p++) {
        near.turn = nav_wrap(nav_histogram_heading(h, p) - pose.theta);
        if (fabs(near.turn) > NAV_NEAR_RAD)
            continue;
        double at = (pose.y - h->shift_y[p]) / h->shape.cell, reach = NAV_NEAR_M / h->shape.cell;
        int begin = (int)fmax(floor(at - reach), 0.0), end = (int)fmin(ceil(at + reach) + 1.0, h->shape.ny);
        for (int j = begin; j < end; j++)
            histogram_visit_line(&v, p, j);
    }
    if (mean && near.mass > 0.0)
        *mean = (struct nav_pose){pose.x + near.x / near.mass, pose.y + near.y / near.mass,
                                  nav_wrap(pose.theta + near.theta / near.mass)};
    return near.mass;
}

/* Mass of cells within reach of a pose that is taken back to where they were. */
struct within {
    struct nav_component each;
    struct nav_pose pose;
    double turn, mass;
};

static void histogram_within_take(void *self, struct nav_pose at, double mass)
{
    struct within *w = self;
    double x = at.x - w->pose.x, y = at.y - w->pose.y;
    w->mass += mass * nav_component_near(x * x + y * y, w->turn, w->each.sigma_m, w->each.sigma_rad);
}

double nav_histogram_within(const struct nav_histogram *h, const struct nav_pending *pending, struct nav_pose pose)
{
    struct within within = {.each = histogram_kernel(h, pending)};
    const struct visit v = {h, histogram_within_take, &within};
    for (int p = 0; p < h->shape.nh && h->total > 0.0; p++) {
        double heading = nav_histogram_heading(h, p);
        within.turn = nav_wrap(heading + pending->step.theta - pose.theta);
        if (fabs(within.turn) > NAV_NEAR_RAD + NAV_COMPONENT_REACH * within.each.sigma_rad)
            continue;
        const struct nav_pose moved = nav_compose((struct nav_pose){0.0, 0.0, heading}, pending->step);
        within.pose = (struct nav_pose){pose.x - moved.x, pose.y - moved.y, 0.0};
        double at = (within.pose.y - h->shift_y[p]) / h->shape.cell;
        double reach = (NAV_NEAR_M + NAV_COMPONENT_REACH * within.each.sigma_m) / h->shape.cell;
        int begin = (int)fmax(fmin(floor(at - reach), h->shape.ny), 0.0);
        int end = (int)fmax(fmin(ceil(at + reach) + 1.0, h->shape.ny), 0.0);
        for (int j = begin; j < end; j++)
            histogram_visit_line(&v, p, j);
    }
    return h->total > 0.0 ? fmin(within.mass / h->total, 1.0) : 0.0;
}

/* Adds one slice's moments about (x, y) to sums xx, xy, yy, xt, yt, tt, its heading being off by `turn`. */
static void histogram_add_moments(const double m[NAV_MOMENTS], double x, double y, double turn, double sums[6])
{
    double mx = m[1] - x * m[0], my = m[2] - y * m[0];
    sums[0] += m[3] - 2.0 * x * m[1] + x * x * m[0];
    sums[1] += m[4] - x * m[2] - y * m[1] + x * y * m[0];
    sums[2] += m[5] - 2.0 * y * m[2] + y * y * m[0];
    sums[3] += mx * turn;
    sums[4] += my * turn;
    sums[5] += m[0] * turn * turn;
}

/* Covariance about a pose once the cells have moved, that within a cell and noise left out. */
static void histogram_moved(const struct nav_histogram *h, struct nav_pose step, struct nav_pose pose, double out[9])
{
    double sums[6] = {0.0};
    for (int p = 0; p < h->shape.nh; p++) {
        const struct nav_pose moved =
            nav_compose((struct nav_pose){h->about.x, h->about.y, nav_histogram_heading(h, p)}, step);
        histogram_add_moments(h->moment[p], pose.x - moved.x, pose.y - moved.y, nav_wrap(moved.theta - pose.theta),
                              sums);
    }
    for (int k = 0; k < 6; k++)
        sums[k] /= h->total;
    const double all[9] = {
        fmax(sums[0], 0.0), sums[1], sums[3], sums[1], fmax(sums[2], 0.0), sums[4], sums[3], sums[4], sums[5]};
    memcpy(out, all, sizeof all);
}

void nav_histogram_covariance(const struct nav_histogram *h, const struct nav_pending *pending, struct nav_pose pose,
                              double out[9])
{
    const struct nav_component each = histogram_kernel(h, pending);
    histogram_moved(h, pending->step, pose, out);
    out[0] += each.sigma_m * each.sigma_m;
    out[4] += each.sigma_m * each.sigma_m;
    out[8] += each.sigma_rad * each.sigma_rad;
}

double nav_histogram_mode(const struct nav_histogram *h, struct nav_pose *mean)
{
    *mean = h->mode;
    nav_histogram_near(h, h->mode, mean);
    return fmin(nav_histogram_near(h, *mean, NULL) / h->total, 1.0);
}

struct draw {
    const struct nav_histogram *h;
    struct nav_rng *rng;
    double mark, step, sum;
    struct nav_pose *out;
    long count, room;
};

static void histogram_draw_take(void *self, struct nav_pose at, double mass)
{
    struct draw *d = self;
    const struct nav_shape *s = &d->h->shape;
    for (d->sum += mass; d->mark < d->sum && d->count < d->room; d->mark += d->step) {
        double x = nav_rng_uniform(d->rng) - 0.5, y = nav_rng_uniform(d->rng) - 0.5, t = nav_rng_uniform(d->rng) - 0.5;
        d->out[d->count++] = (struct nav_pose){at.x + s->cell * x, at.y + s->cell * y, at.theta + s->cell_theta * t};
    }
}

long nav_histogram_draw(const struct nav_histogram *h, struct nav_rng *rng, long count, struct nav_pose *out, long room)
{
    struct draw d = {.h = h, .rng = rng, .step = h->total / (double)count, .out = out, .room = room};
    d.mark = d.step * nav_rng_uniform(rng);
    nav_histogram_each(h, histogram_draw_take, &d);
    return d.count;
}
