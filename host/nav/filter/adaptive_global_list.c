/* The arena-wide belief listed cell by cell, a job under way included. */
#include <math.h>

#include "adaptive_global_parts.h"

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
    const struct nav_slices slices = adaptive_global_slices(g);
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
            struct nav_pose at = nav_slices_centre(&slices, n);
            at.theta += after ? g->job.step.theta : 0.0;
            out[count] = bump;
            out[count].pose = nav_compose(at, after ? since_job : since);
        }
        count++;
    }
    return count;
}
