#include "adaptive_prior.h"

#include <math.h>
#include <string.h>

#include "adaptive_global_parts.h"

/* Mass, its sums and the heaviest cell of slice p. */
static void sum_slice(struct adaptive_global *g, const struct nav_slices *slices, int p, double *squares)
{
    double *m = g->moment[p];
    memset(m, 0, sizeof g->moment[p]);
    for (size_t n = (size_t)p * (size_t)(g->ny * g->pitch); n < (size_t)(p + 1) * (size_t)(g->ny * g->pitch); n++) {
        double held = (double)g->mass[n];
        struct nav_pose at = nav_slices_centre(slices, n);
        const double parts[NAV_MOMENTS] = {1.0, at.x, at.y, at.x * at.x, at.x * at.y, at.y * at.y};
        for (int k = 0; k < NAV_MOMENTS; k++)
            m[k] += held * parts[k];
        *squares += held * held;
        g->mode = g->mass[n] > g->mass[g->mode] ? n : g->mode;
    }
    g->total += m[0];
}

double adaptive_global_fill(struct adaptive_global *g)
{
    double squares = 0.0;
    g->job.about = (struct nav_pose){0.0, 0.0, 0.0};
    g->mode = 0;
    const struct nav_slices slices = adaptive_global_slices(g);
    nav_bumps_fill(&g->problem->prior, &slices, g->mass);
    for (size_t n = 0; n < (size_t)g->nh * (size_t)g->ny; n++)
        g->span[n] = (struct adaptive_span){0, g->pitch};
    g->total = 0.0;
    for (int p = 0; p < g->nh; p++)
        sum_slice(g, &slices, p, &squares);
    g->fresh = false;
    adaptive_global_summarise(g);
    return g->total * g->total / squares;
}
