/* Nanoseconds per pose and step of the grid filter, beside plain passes over as many floats.
 *
 * Usage: nav_bench [CELL_M CELL_DEG SUB STEPS]   default: 5 cm x 10 degrees, 2.5 cm x 5 degrees, 1 cm x 3 degrees
 * Prints one JSON object per line: poses (cells x headings of the 2.5 m arena, where the robot cannot stand included),
 * CPU time of the thread per step: median and p90 over the steps, and of the dearest kind of step (noise due in
 * position and heading alike); distinct: expected observations worked out per step; scale and add: ns per float of y =
 * a x + b from one array to another, read: of a sum over the array. */
#define _POSIX_C_SOURCE 200809L

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "filter.h"
#include "rng.h"

enum { TILES = 5, BOXES = 3, RAYS = 4, TIPS = 2, CLASSES = 3 };
static const double SIZE = 2.5;

static double cpu_ns(void)
{
    struct timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return 1e9 * (double)t.tv_sec + (double)t.tv_nsec;
}

static int compare(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double quantile(double *values, int n, double q)
{
    qsort(values, (size_t)n, sizeof *values, compare);
    return values[(int)(q * (n - 1))];
}

/* The arena and robot of the anchor scenes: solid blocks fill tiles. */
static struct nav_problem problem(struct nav_rng *rng, double cell_m, double cell_deg, double sub)
{
    static uint8_t floor_[TILES * TILES];
    static struct nav_box box[BOXES];
    static const struct nav_tip tip[TIPS] = {{0.05, 0.2}, {0.05, -0.2}};
    static const struct nav_ray ray[RAYS] = {
        {0.13, 0.05, 0.2, 0.14}, {0.13, -0.05, -0.2, 0.14}, {0.1, 0.1, 0.7, 0.14}, {0.1, -0.1, -0.7, 0.14}};
    for (int i = 0; i < TILES * TILES; i++)
        floor_[i] = (uint8_t)(nav_rng_bits(rng) % CLASSES);
    for (int i = 0; i < BOXES; i++) {
        double x = (double)(nav_rng_bits(rng) % TILES) * 0.5, y = (double)(nav_rng_bits(rng) % TILES) * 0.5;
        box[i] = (struct nav_box){x, y, x + 0.5, y + 0.5};
    }
    struct nav_problem p = {
        .arena = {SIZE, SIZE, SIZE / TILES, TILES, TILES, floor_, CLASSES, BOXES, box},
        .robot = {0.165, 0.05, 0.005, TIPS, tip, RAYS, ray},
        .prior = {.uniform = true},
    };
    nav_settings_default(&p.settings);
    p.settings.grid.cell_m = cell_m;
    p.settings.grid.cell_deg = cell_deg;
    p.settings.grid.sub = p.settings.grid.sub_heading = sub;
    return p;
}

/* A row whose readings say next to nothing, so that the belief stays spread over the whole arena. */
static void next_row(struct nav_rng *rng, int step, bool dear, double *texture, double *radial, struct nav_row *row)
{
    for (int i = 0; i < TIPS * CLASSES; i++)
        texture[i] = 0.3 * nav_rng_normal(rng);
    for (int i = 0; i < RAYS; i++)
        radial[i] = nav_rng_uniform(rng) < 0.1 ? 0.14 * nav_rng_uniform(rng) : (double)INFINITY;
    *row = (struct nav_row){.t_s = 0.1 * step, .odometry = {0.02, 0.0, 0.05}, .texture = texture, .radial_m = radial};
    if (dear)
        row->odometry[2] = 0.6;
}

struct timing {
    double median, p90, dear, distinct;
};

static struct timing time_grid(const struct nav_problem *p, int steps, struct nav_rng *rng)
{
    struct nav_filter *f = nav_filter_new("grid", p);
    double *ns = calloc((size_t)steps, sizeof *ns), texture[TIPS * CLASSES], radial[RAYS];
    struct timing t = {.distinct = 0.0};
    struct nav_row row;
    struct nav_estimate e = {.states = 0};
    for (int kind = 0; f && ns && kind < 2; kind++) {
        for (int i = 0; i < steps; i++) {
            next_row(rng, kind * steps + i, kind == 1, texture, radial, &row);
            double begin = cpu_ns();
            nav_filter_step(f, &row, &e);
            ns[i] = (cpu_ns() - begin) / (double)e.states;
            t.distinct += (double)e.distinct / (2.0 * steps);
        }
        if (kind == 1) {
            t.dear = quantile(ns, steps, 0.5);
            break;
        }
        t.median = quantile(ns, steps, 0.5);
        t.p90 = quantile(ns, steps, 0.9);
    }
    free(ns);
    nav_filter_free(f);
    return t;
}

/* Median ns per float of a plain pass. */
static double time_plain(size_t n, int steps, bool write)
{
    float *x = calloc(n, sizeof *x), *y = calloc(n, sizeof *y);
    double *ns = calloc((size_t)steps, sizeof *ns), median = NAN;
    volatile float a = 0.5f, b = 0.25f, sink = 0.0f;
    for (int s = 0; x && y && ns && s < steps; s++) {
        double begin = cpu_ns();
        float lane[16] = {0.0f}, scale = a, offset = b;
        for (size_t i = 0; write && i < n; i++)
            y[i] = scale * x[i] + offset;
        for (size_t i = 0; !write && i + 16 <= n; i += 16) {
            for (size_t k = 0; k < 16; k++)
                lane[k] += x[i + k];
        }
        ns[s] = (cpu_ns() - begin) / (double)n;
        sink = sink + y[n / 2] + lane[3];
        median = s == steps - 1 ? quantile(ns, steps, 0.5) : median;
    }
    free(x);
    free(y);
    free(ns);
    return median;
}

static void bench(double cell_m, double cell_deg, double sub, int steps)
{
    struct nav_rng rng;
    nav_rng_seed(&rng, 1, 0);
    struct nav_problem p = problem(&rng, cell_m, cell_deg, sub);
    double poses = ceil(SIZE / cell_m - 1e-6) * ceil(SIZE / cell_m - 1e-6) * round(360.0 / cell_deg);
    struct timing t = time_grid(&p, steps, &rng);
    printf("{\"cell_m\": %g, \"cell_deg\": %g, \"sub\": %g, \"poses\": %.0f, \"steps\": %d, ", cell_m, cell_deg, sub,
           poses, steps);
    printf(
        "\"ns_per_pose_median\": %.3f, \"ns_per_pose_p90\": %.3f, \"ns_per_pose_dearest\": %.3f, \"distinct\": %.0f, ",
        t.median, t.p90, t.dear, t.distinct);
    printf("\"scale_ns_per_float\": %.3f, \"read_ns_per_float\": %.3f}\n", time_plain((size_t)poses, steps, true),
           time_plain((size_t)poses, steps, false));
    fflush(stdout);
}

int main(int argc, char **argv)
{
    if (argc == 5) {
        bench(atof(argv[1]), atof(argv[2]), atof(argv[3]), atoi(argv[4]));
        return 0;
    }
    bench(0.05, 10.0, 2.0, 400);
    bench(0.025, 5.0, 2.0, 100);
    bench(0.01, 3.0, 1.0, 40);
    return 0;
}
