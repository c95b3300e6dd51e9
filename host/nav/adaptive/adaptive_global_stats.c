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
    size_t pitch = (size_t)g->pitch, ny = (size_t)g->ny;
    int p = (int)(n / pitch / ny), j = (int)(n / pitch % ny), i = (int)(n % pitch);
    return (struct nav_pose){(i + 0.5) * g->cell + g->shift_x[p], (j + 0.5) * g->cell + g->shift_y[p],
                             nav_wrap(heading_of(g, p))};
}

struct nav_slice adaptive_global_slice(const struct adaptive_global *g, int p)
{
    return (struct nav_slice){.mass = adaptive_global_line(g, g->mass, p, 0),
                              .nx = g->nx,
                              .ny = g->ny,
                              .pitch = g->pitch,
                              .cell = g->cell,
                              .x = 0.5 * g->cell + g->shift_x[p],
                              .y = 0.5 * g->cell + g->shift_y[p],
                              .heading = heading_of(g, p)};
}

double adaptive_global_near(const struct adaptive_global *g, struct nav_pose pose, struct nav_pose *mean)
{
    struct nav_near sums = {.mass = 0.0};
    if (g->fresh)
        return g->summary.near;
    for (int p = 0; p < g->nh; p++) {
        const struct nav_slice slice = adaptive_global_slice(g, p);
        nav_slice_near(&slice, pose, &sums);
    }
    if (mean && sums.mass > 0.0)
        *mean = nav_near_mean(&sums, pose);
    return fmin(sums.mass / g->total, 1.0);
}

void adaptive_global_summarise(struct adaptive_global *g)
{
    struct adaptive_summary *s = &g->summary;
    double sums[6] = {0.0};
    *s = (struct adaptive_summary){.near = 0.0};
    s->belief.mean = adaptive_global_centre(g, g->mode);
    adaptive_global_near(g, s->belief.mean, &s->belief.mean);
    s->near = adaptive_global_near(g, s->belief.mean, NULL);
    for (int p = 0; p < g->nh; p++)
        nav_slice_add(g->moment[p], s->belief.mean.x - g->job.about.x, s->belief.mean.y - g->job.about.y,
                      nav_wrap(heading_of(g, p) - s->belief.mean.theta), sums);
    nav_slice_covariance(sums, g->total, g->cell, g->cell_theta, s->belief.covariance);
}

/* Mass of the cell that holds a pose. */
static double mass_at(const struct adaptive_global *g, struct nav_pose pose)
{
    double turns = (pose.theta - g->rotation) / (2.0 * NAV_PI);
    int p = (int)((turns - floor(turns)) * g->nh) % g->nh;
    int i = (int)floor((pose.x - g->shift_x[p]) / g->cell), j = (int)floor((pose.y - g->shift_y[p]) / g->cell);
    if (i < 0 || j < 0 || i >= g->nx || j >= g->ny)
        return 0.0;
    return (double)adaptive_global_line(g, g->mass, p, j)[i];
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
    for (size_t n = 0; n < adaptive_global_stored(g); n++) {
        size_t line = n / (size_t)g->pitch;
        if (n % (size_t)g->pitch == 0 && g->span[line].begin == g->span[line].end) {
            n += (size_t)g->pitch - 1;
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
    if (!g->job.running || g->job.phase == ADAPTIVE_TURN)
        return 0;
    return g->job.phase == ADAPTIVE_MOVE ? g->job.slice : g->nh;
}

/* Mass of one slice's cells; a uniform belief is not written out before its first job comes by. */
static double slice_mass(const struct adaptive_global *g, int p)
{
    const float *cell = adaptive_global_line(g, g->mass, p, 0);
    double sum = 0.0;
    for (int i = 0; i < g->ny * g->pitch; i++)
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
    for (size_t n = 0; n < adaptive_global_stored(g); n++) {
        bool after = n < (size_t)done * (size_t)(g->ny * g->pitch);
        if (n % (size_t)g->pitch >= (size_t)g->nx)
            continue;
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
