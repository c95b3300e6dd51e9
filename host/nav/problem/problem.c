#include "problem.h"

#include <math.h>

static const char *problem_component_fault(const struct nav_arena *arena, const struct nav_component *b)
{
    if (!isfinite(b->pose.x + b->pose.y + b->pose.theta))
        return "its pose is no number";
    if (!(b->pose.x >= 0.0 && b->pose.x <= arena->size_x && b->pose.y >= 0.0 && b->pose.y <= arena->size_y))
        return "it lies outside the arena";
    if (!(b->sigma_m > 0.0 && isfinite(b->sigma_m) && b->sigma_rad > 0.0 && isfinite(b->sigma_rad)))
        return "its width is not above 0";
    return b->mass >= 0.0 && isfinite(b->mass) ? NULL : "its mass is negative or no number";
}

const char *nav_prior_fault(const struct nav_arena *arena, const struct nav_prior *prior, long *which)
{
    double total = 0.0;
    *which = -1;
    if (prior->uniform || prior->components == 0)
        return NULL;
    if (prior->components < 0 || prior->components > NAV_COMPONENTS_MOST || !prior->component)
        return "too many components, or less than none";
    for (long n = 0; n < prior->components; n++) {
        const char *fault = problem_component_fault(arena, &prior->component[n]);
        if (fault) {
            *which = n;
            return fault;
        }
        total += prior->component[n].mass;
    }
    return total > 0.0 && isfinite(total) ? NULL : "the components have no mass, or no end of it";
}
