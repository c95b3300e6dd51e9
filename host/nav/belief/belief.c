#include "belief.h"

#include <math.h>
#include <stdlib.h>

enum { RASTER_MOST = 1024 };
static const double SHARE = 0.9;
static const double MASS_LEAST = 1e-7; /* lighter components do not stretch the raster */

/* An interval of even density; an edge-less one has all its mass at one place. */
struct slab {
    double low, high;
};

static struct slab belief_slab(double centre, double sigma)
{
    double half = sigma * sqrt(3.0);
    return (struct slab){centre - half, centre + half};
}

/* Share of a slab that lies in low .. high. */
static double belief_overlap(struct slab s, double low, double high)
{
    if (!(s.high > s.low))
        return s.low >= low && s.low < high ? 1.0 : 0.0;
    return fmax(fmin(s.high, high) - fmax(s.low, low), 0.0) / (s.high - s.low);
}

struct raster {
    double x0, y0, pitch; /* m */
    int nx, ny;
    double *mass;
};

static int belief_index(double offset, double pitch, int count)
{
    double index = floor(offset / pitch);
    if (!(index > 0.0))
        return 0;
    return index < count ? (int)index : count - 1;
}

struct extent {
    struct slab x, y;
    double sigma; /* of the narrowest component */
};

static struct extent belief_extent(const struct nav_component *c, long n, double total)
{
    struct extent e = {{INFINITY, -INFINITY}, {INFINITY, -INFINITY}, INFINITY};
    for (long i = 0; i < n; i++) {
        if (!(c[i].mass > MASS_LEAST * total))
            continue;
        struct slab x = belief_slab(c[i].pose.x, c[i].sigma_m), y = belief_slab(c[i].pose.y, c[i].sigma_m);
        e.x = (struct slab){fmin(e.x.low, x.low), fmax(e.x.high, x.high)};
        e.y = (struct slab){fmin(e.y.low, y.low), fmax(e.y.high, y.high)};
        e.sigma = fmin(e.sigma, c[i].sigma_m);
    }
    return e;
}

/* Bins a quarter as wide as the narrowest component, as far as that gives no more than RASTER_MOST a side. */
static int belief_raster_init(struct raster *r, const struct extent *e)
{
    double width = e->x.high - e->x.low, height = e->y.high - e->y.low;
    double pitch = fmax(fmax(e->sigma * sqrt(3.0) / 2.0, fmax(width, height) / (RASTER_MOST - 2)), 1e-6);
    if (!(fmin(width, height) >= 0.0 && isfinite(pitch))) /* no component lies anywhere */
        return -1;
    *r = (struct raster){.x0 = e->x.low - pitch / 2.0, .y0 = e->y.low - pitch / 2.0, .pitch = pitch};
    r->nx = (int)(width / pitch) + 2;
    r->ny = (int)(height / pitch) + 2;
    r->mass = calloc((size_t)r->nx * (size_t)r->ny, sizeof *r->mass);
    return r->mass ? 0 : -1;
}

/* Share of a slab in bin i of `count`; the outermost bins reach out to infinity. */
static double belief_share(struct slab s, int i, double pitch, int count)
{
    double low = i == 0 ? (double)-INFINITY : i * pitch, high = i == count - 1 ? (double)INFINITY : (i + 1) * pitch;
    return belief_overlap(s, low, high);
}

static void belief_draw(struct raster *r, const struct nav_component *c, double mass)
{
    struct slab x = belief_slab(c->pose.x - r->x0, c->sigma_m), y = belief_slab(c->pose.y - r->y0, c->sigma_m);
    int first = belief_index(x.low, r->pitch, r->nx), last = belief_index(x.high, r->pitch, r->nx);
    for (int j = belief_index(y.low, r->pitch, r->ny); j <= belief_index(y.high, r->pitch, r->ny); j++) {
        double row = mass * belief_share(y, j, r->pitch, r->ny);
        for (int i = first; i <= last; i++)
            r->mass[(size_t)j * (size_t)r->nx + (size_t)i] += row * belief_share(x, i, r->pitch, r->nx);
    }
}

static int belief_descending(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x < y) - (x > y);
}

/* Sorts the raster's masses: the point's bin is looked up before. */
static double belief_area(struct raster *r, double total)
{
    size_t count = 0, all = (size_t)r->nx * (size_t)r->ny;
    for (size_t i = 0; i < all; i++) {
        if (r->mass[i] > 0.0)
            r->mass[count++] = r->mass[i];
    }
    qsort(r->mass, count, sizeof *r->mass, belief_descending);
    double held = 0.0, bins = 0.0;
    for (size_t i = 0; i < count && held < SHARE * total; i++) {
        bins += fmin(1.0, (SHARE * total - held) / r->mass[i]);
        held += r->mass[i];
    }
    return bins * r->pitch * r->pitch;
}

static double belief_level(const struct raster *r, double x, double y, double total)
{
    double i = floor((x - r->x0) / r->pitch), j = floor((y - r->y0) / r->pitch);
    if (!(i >= 0.0 && i < r->nx && j >= 0.0 && j < r->ny))
        return 1.0;
    double own = r->mass[(size_t)j * (size_t)r->nx + (size_t)i], denser = own > 0.0 ? own / 2.0 : 0.0;
    for (size_t k = 0; k < (size_t)r->nx * (size_t)r->ny; k++) {
        if (r->mass[k] > own)
            denser += r->mass[k];
    }
    return fmin(denser / total, 1.0);
}

int nav_belief_region(const struct nav_component *c, long n, double x, double y, struct nav_region *out)
{
    double total = 0.0;
    for (long i = 0; i < n; i++)
        total += fmax(c[i].mass, 0.0);
    struct raster r = {.mass = NULL};
    struct extent e = belief_extent(c, n, total);
    *out = (struct nav_region){.level = 1.0};
    if (!(total > 0.0 && isfinite(total)) || belief_raster_init(&r, &e))
        return -1;
    for (long i = 0; i < n; i++) {
        if (c[i].mass > 0.0)
            belief_draw(&r, &c[i], c[i].mass);
    }
    out->level = belief_level(&r, x, y, total);
    out->area_m2 = belief_area(&r, total);
    free(r.mass);
    return 0;
}
