#include "problem.h"

#include <math.h>

static const char *problem_bump_fault(const struct nav_arena *arena, const struct nav_component *b)
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
    if (prior->uniform || prior->bumps == 0)
        return NULL;
    if (prior->bumps < 0 || prior->bumps > NAV_BUMPS_MOST || !prior->bump)
        return "too many bumps, or less than none";
    for (long n = 0; n < prior->bumps; n++) {
        const char *fault = problem_bump_fault(arena, &prior->bump[n]);
        if (fault) {
            *which = n;
            return fault;
        }
        total += prior->bump[n].mass;
    }
    return total > 0.0 && isfinite(total) ? NULL : "the bumps have no mass, or no end of it";
}
