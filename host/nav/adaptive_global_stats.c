/* What the arena-wide belief amounts to, and hypotheses drawn from it. */
#include <math.h>
#include <string.h>

#include "adaptive_global.h"

static double heading_of(const struct adaptive_global *g, int p)
{
    return (p + 0.5) * g->cell_theta + g->rotation;
}

struct nav_pose adaptive_global_centre(const struct adaptive_global *g, size_t n)
{
    int p = (int)(n / ((size_t)g->nx * (size_t)g->ny)), j = (int)(n / (size_t)g->nx % (size_t)g->ny);
    int i = (int)(n % (size_t)g->nx);
    return (struct nav_pose){(i + 0.5) * g->cell + g->shift_x[p], (j + 0.5) * g->cell + g->shift_y[p],
                             nav_wrap(heading_of(g, p))};
}

struct sums {
    double mass, x, y, theta; /* offsets from the pose, times mass */
};

static void near_in_slice(const struct adaptive_global *g, int p, struct nav_pose pose, double turn, struct sums *s)
{
    double x0 = 0.5 * g->cell + g->shift_x[p] - pose.x, y0 = 0.5 * g->cell + g->shift_y[p] - pose.y;
    int first_j = (int)fmax(ceil((-NAV_NEAR_M - y0) / g->cell), 0.0);
    int first_i = (int)fmax(ceil((-NAV_NEAR_M - x0) / g->cell), 0.0);
    for (int j = first_j; j < g->ny && y0 + j * g->cell <= NAV_NEAR_M; j++) {
        const float *row = g->mass + ((size_t)p * (size_t)g->ny + (size_t)j) * (size_t)g->nx;
        double y = y0 + j * g->cell;
        for (int i = first_i; i < g->nx && x0 + i * g->cell <= NAV_NEAR_M; i++) {
            double x = x0 + i * g->cell, mass = (double)row[i];
            if (x * x + y * y > NAV_NEAR_M * NAV_NEAR_M)
                continue;
            s->mass += mass;
            s->x += mass * x;
            s->y += mass * y;
            s->theta += mass * turn;
        }
    }
}

double adaptive_global_near(const struct adaptive_global *g, struct nav_pose pose, struct nav_pose *mean)
{
    struct sums s = {.mass = 0.0};
    if (g->fresh)
        return g->summary.near;
    for (int p = 0; p < g->nh; p++) {
        double turn = nav_wrap(heading_of(g, p) - pose.theta);
        if (fabs(turn) <= NAV_NEAR_RAD)
            near_in_slice(g, p, pose, turn, &s);
    }
    if (mean && s.mass > 0.0)
        *mean =
            (struct nav_pose){pose.x + s.x / s.mass, pose.y + s.y / s.mass, nav_wrap(pose.theta + s.theta / s.mass)};
    return fmin(s.mass / g->total, 1.0);
}

/* Adds a slice's second moments about a pose. */
static void add_slice(const struct adaptive_global *g, int p, struct nav_pose about, double covariance[9])
{
    const double *m = g->moment + 6 * p;
    double x = m[1] - about.x * m[0], y = m[2] - about.y * m[0], t = nav_wrap(heading_of(g, p) - about.theta);
    double xx = m[3] - about.x * (m[1] + x), xy = m[4] - about.x * m[2] - about.y * x;
    double yy = m[5] - about.y * (m[2] + y);
    const double add[9] = {xx, xy, t * x, xy, yy, t * y, t * x, t * y, t * t * m[0]};
    for (int k = 0; k < 9; k++)
        covariance[k] += add[k] / g->total;
}

void adaptive_global_summarise(struct adaptive_global *g)
{
    struct adaptive_summary *s = &g->summary;
    *s = (struct adaptive_summary){.near = 0.0};
    s->belief.mean = adaptive_global_centre(g, g->mode);
    adaptive_global_near(g, s->belief.mean, &s->belief.mean);
    s->near = adaptive_global_near(g, s->belief.mean, NULL);
    for (int p = 0; p < g->nh; p++)
        add_slice(g, p, s->belief.mean, s->belief.covariance);
    s->belief.covariance[0] += g->cell * g->cell / 12.0;
    s->belief.covariance[4] += g->cell * g->cell / 12.0;
    s->belief.covariance[8] += g->cell_theta * g->cell_theta / 12.0;
    double worth = g->total / g->room, size = 1.0;
    g->scattered = g->job.sized ? 0.0 : 1.0;
    g->crowd = 0.0;
    for (int n = 0; n < ADAPTIVE_SIZES; n++, size /= 2.0) {
        /* Cells of this size hold size / 2 .. size, about 3/4 of it. */
        if (size / 2.0 < worth)
            g->scattered += 0.75 * size * g->job.many[n] / g->total;
        else
            g->crowd += g->job.many[n];
    }
}

/* Mass of the cell that holds a pose. */
static double mass_at(const struct adaptive_global *g, struct nav_pose pose)
{
    double turns = (pose.theta - g->rotation) / (2.0 * NAV_PI);
    int p = (int)((turns - floor(turns)) * g->nh) % g->nh;
    int i = (int)floor((pose.x - g->shift_x[p]) / g->cell), j = (int)floor((pose.y - g->shift_y[p]) / g->cell);
    if (i < 0 || j < 0 || i >= g->nx || j >= g->ny)
        return 0.0;
    return (double)g->mass[((size_t)p * (size_t)g->ny + (size_t)j) * (size_t)g->nx + (size_t)i];
}

/* What each image of a cell holds of their mass together. */
static void shares(const struct adaptive_global *g, int images, struct nav_pose centre,
                   float share[ADAPTIVE_IMAGES_MOST])
{
    double part[ADAPTIVE_IMAGES_MOST], sum = 0.0;
    memset(share, 0, ADAPTIVE_IMAGES_MOST * sizeof *share);
    for (int m = 0; m < images; m++)
        sum += part[m] = mass_at(g, adaptive_image(&g->problem->arena, images, m, centre));
    for (int m = 0; m < images; m++)
        share[m] = sum > 0.0 ? (float)(part[m] / sum) : (m == 0);
}

static struct nav_pose within_cell(const struct adaptive_global *g, struct nav_pose centre, struct nav_rng *rng)
{
    return (struct nav_pose){centre.x + g->cell * (nav_rng_uniform(rng) - 0.5),
                             centre.y + g->cell * (nav_rng_uniform(rng) - 0.5),
                             centre.theta + g->cell_theta * (nav_rng_uniform(rng) - 0.5)};
}

void adaptive_global_draw(struct adaptive_global *g, struct adaptive_cloud *cloud, long count, double weight,
                          struct nav_pose moved)
{
    double step = g->total / (double)count, mark = step * nav_rng_uniform(&cloud->rng), sum = 0.0;
    float share[ADAPTIVE_IMAGES_MOST];
    for (size_t n = 0; n < adaptive_global_cells(g); n++) {
        if (n % (size_t)g->nx == 0 && !g->live[n / (size_t)g->nx]) {
            n += (size_t)g->nx - 1;
            continue;
        }
        sum += (double)g->mass[n];
        if (mark >= sum)
            continue;
        struct nav_pose centre = adaptive_global_centre(g, n);
        shares(g, cloud->images, centre, share);
        for (; mark < sum; mark += step)
            adaptive_cloud_add(cloud, nav_compose(within_cell(g, centre, &cloud->rng), moved), weight / (double)count,
                               share);
    }
}

/* Slices that the present job has moved and weighed. */
static int slices_done(const struct adaptive_global *g)
{
    return g->job.running && !g->job.turning ? g->job.slice : 0;
}

/* Mass of one slice's cells; a uniform belief is not written out before its first job comes by. */
static double slice_mass(const struct adaptive_global *g, int p)
{
    const float *cell = g->mass + (size_t)p * adaptive_global_plane(g);
    double sum = 0.0;
    for (size_t i = 0; i < adaptive_global_plane(g); i++)
        sum += (double)cell[i];
    return sum;
}

/* What a unit of mass is worth in slices that are done, and in those that are not. */
struct worth {
    double done, waiting;
};

static struct worth worth_of(const struct adaptive_global *g)
{
    int done = slices_done(g);
    double left = (double)(g->nh - done) / g->nh, weighed = 0.0;
    for (int p = 0; p < done; p++)
        weighed += slice_mass(g, p);
    struct worth w = {.waiting = 1.0 / g->total};
    if (!g->fresh) {
        left = 0.0;
        for (int p = done; p < g->nh; p++)
            left += slice_mass(g, p) / g->total;
    }
    if (weighed > 0.0)
        w.done = fmax(1.0 - left, 0.0) / weighed;
    else if (left > 0.0)
        w.waiting /= left; /* all that was weighed has come to nothing */
    return w;
}

long adaptive_global_list(const struct adaptive_global *g, const struct adaptive_log *log, struct nav_pose moved,
                          double mass, struct nav_component *out, long room)
{
    int done = slices_done(g);
    struct worth worth = worth_of(g);
    struct nav_pose since = nav_compose(adaptive_log_since(log, g->next), moved);
    struct nav_pose since_job = done ? nav_compose(adaptive_log_since(log, g->job.end), moved) : since;
    struct nav_component bump = {.sigma_m = g->cell / sqrt(12.0), .sigma_rad = g->cell_theta / sqrt(12.0)};
    long count = 0;
    for (size_t n = 0; n < adaptive_global_cells(g); n++) {
        bool after = n < (size_t)done * adaptive_global_plane(g);
        double held = g->fresh && !after ? 1.0 / (double)adaptive_global_cells(g) : (double)g->mass[n];
        bump.mass = mass * held * (after ? worth.done : worth.waiting);
        if (!(bump.mass > 0.0))
            continue;
        if (count < room) {
            struct nav_pose at = adaptive_global_centre(g, n);
            at.theta += after ? g->job.step.theta : 0.0;
            out[count] = bump;
            out[count].pose = nav_compose(at, after ? since_job : since);
        }
        count++;
    }
    return count;
}
