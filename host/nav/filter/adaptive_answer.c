#include "adaptive_answer.h"

#include <math.h>

#include "mixture.h"

/* What one of the two beliefs says about a pose. */
struct said {
    double covariance[9], within;
};

/* Anywhere, as one component. */
static struct nav_component answer_anywhere(const struct adaptive_held *h)
{
    const struct nav_arena *arena = &h->problem->arena;
    return (struct nav_component){.pose = {arena->size_x / 2.0, arena->size_y / 2.0, 0.0},
                                  .sigma_m = hypot(arena->size_x, arena->size_y) / sqrt(24.0),
                                  .sigma_rad = NAV_PI / sqrt(3.0),
                                  .mass = h->share};
}

static struct said answer_other(const struct adaptive_held *h, const struct nav_pending *pending, struct nav_pose pose)
{
    struct said said;
    if (h->global) {
        const struct nav_histogram *cells = &h->global->histogram;
        struct nav_pending since = adaptive_global_since(h->global, h->log, pending);
        nav_histogram_covariance(cells, &since, pose, said.covariance);
        said.within = nav_histogram_within(cells, &since, pose);
        return said;
    }
    struct nav_component all = answer_anywhere(h);
    struct nav_gaussian g = nav_gaussian_uniform(&h->problem->arena);
    double x = pose.x - g.mean.x, y = pose.y - g.mean.y;
    nav_gaussian_covariance(&g, pose, said.covariance);
    said.within = nav_component_near(x * x + y * y, nav_wrap(pose.theta), all.sigma_m, all.sigma_rad);
    return said;
}

static struct said answer_local(const struct adaptive_held *h, struct nav_pose answer,
                                const struct nav_pending *pending, struct nav_pose pose)
{
    struct said said;
    nav_particles_covariance(h->local, pending, pose, said.covariance);
    said.within = nav_particles_within(h->local, answer, pending, pose);
    return said;
}

void adaptive_answer_estimate(const struct adaptive_held *h, struct nav_pose answer, const struct nav_pending *pending,
                              struct nav_estimate *out)
{
    struct said local = {.within = 0.0}, other = {.within = 0.0};
    out->pose = nav_compose(answer, pending->step);
    out->pose.theta = nav_wrap(out->pose.theta);
    if (h->share < 1.0)
        local = answer_local(h, answer, pending, out->pose);
    if (h->share > 0.0)
        other = answer_other(h, pending, out->pose);
    for (int k = 0; k < 9; k++)
        out->covariance[k] = (1.0 - h->share) * local.covariance[k] + h->share * other.covariance[k];
    out->confidence = (1.0 - h->share) * local.within + h->share * other.within;
}

long adaptive_answer_list(const struct adaptive_held *h, struct nav_pose answer, const struct nav_pending *pending,
                          struct nav_component *out, long room)
{
    long count = 0;
    if (h->local)
        count = nav_particles_components(h->local, answer, pending, 1.0 - h->share, out, room);
    if (!(h->share > 0.0))
        return count;
    long left = room > count ? room - count : 0;
    if (h->global) {
        struct nav_pending since = adaptive_global_since(h->global, h->log, pending);
        return count +
               nav_histogram_components(&h->global->histogram, &since, h->share, left ? out + count : NULL, left);
    }
    if (left)
        out[count] = answer_anywhere(h);
    return count + 1;
}

/* A belief that is likelier as a whole may hold less near any one pose: while it is spread, its heaviest place is a
 * guess. */
struct nav_pose adaptive_answer_pose(const struct adaptive_held *h, struct nav_bins *bins, struct nav_pose guess)
{
    struct nav_mode local = {.mass = 0.0};
    if (h->local)
        local = nav_particles_summary(h->local, bins, guess);
    if (!h->global ||
        (h->local && !(h->share > 0.5 && h->share * h->global->summary.mass > (1.0 - h->share) * local.mass)))
        return local.mean;
    struct nav_pose mean = nav_compose(h->global->summary.mean, adaptive_log_since(h->log, h->global->next).step);
    mean.theta = nav_wrap(mean.theta);
    return mean;
}
