#include "adaptive_cloud.h"

#include <math.h>
#include <stdlib.h>

enum { BOOK = 8192, TRIES = 20 };

/* The body radius and the walls' places are no better known than this. */
static const double GRACE_M = 0.01;
/* Likelihood of standing where the map says one cannot: maps are wrong sometimes. */
static const double BLOCKED = 0.001;

long adaptive_cloud_room(const struct nav_settings *s)
{
    return (long)fmax(fmin(s->adaptive_most, s->adaptive_budget / 10.0), 16.0);
}

int adaptive_cloud_init(struct adaptive_cloud *cloud, const struct nav_problem *problem, int whiskers)
{
    *cloud = (struct adaptive_cloud){.problem = problem, .room = adaptive_cloud_room(&problem->settings)};
    nav_rng_seed(&cloud->rng, problem->seed, 0);
    cloud->at = calloc((size_t)cloud->room, sizeof *cloud->at);
    cloud->spare = calloc((size_t)cloud->room, sizeof *cloud->spare);
    cloud->codes = calloc((size_t)cloud->room * (size_t)whiskers + 1, 1);
    cloud->stamp = calloc(BOOK, sizeof *cloud->stamp);
    return cloud->at && cloud->spare && cloud->codes && cloud->stamp ? 0 : -1;
}

void adaptive_cloud_free(struct adaptive_cloud *cloud)
{
    free(cloud->at);
    free(cloud->spare);
    free(cloud->codes);
    free(cloud->stamp);
}

void adaptive_cloud_place(struct adaptive_cloud *cloud, const struct nav_likelihood *l, struct nav_pose pose)
{
    if (nav_likelihood_clear(l, pose.x, pose.y, GRACE_M))
        adaptive_cloud_add(cloud, pose, 1.0);
}

/* How many hypotheses a number of occupied bins needs. */
static long needed(const struct adaptive_cloud *cloud, double bins)
{
    const struct nav_settings *s = &cloud->problem->settings;
    return (long)fmin(fmax(bins * s->adaptive_per_bin, s->adaptive_least), (double)cloud->room);
}

bool adaptive_cloud_prior(struct adaptive_cloud *cloud, const struct nav_likelihood *l)
{
    const struct nav_prior *prior = &cloud->problem->prior;
    const struct nav_settings *s = &cloud->problem->settings;
    /* Four sigmas of each axis, in bins. */
    double bins = fmax(4.0 * prior->sigma[0] / s->adaptive_bin_m, 1.0) *
                  fmax(4.0 * prior->sigma[1] / s->adaptive_bin_m, 1.0) *
                  fmax(4.0 * prior->sigma[2] / (s->adaptive_bin_deg * NAV_PI / 180.0), 1.0);
    long count = needed(cloud, bins);
    cloud->count = 0;
    for (long n = 0; n < count * TRIES && cloud->count < count; n++) {
        struct nav_pose pose = {prior->mean.x + prior->sigma[0] * nav_rng_normal(&cloud->rng),
                                prior->mean.y + prior->sigma[1] * nav_rng_normal(&cloud->rng),
                                prior->mean.theta + prior->sigma[2] * nav_rng_normal(&cloud->rng)};
        adaptive_cloud_place(cloud, l, pose);
    }
    adaptive_cloud_scale(cloud, 1.0 / fmax((double)cloud->count, 1.0));
    return cloud->count > 0;
}

void adaptive_cloud_scale(struct adaptive_cloud *cloud, double factor)
{
    for (long n = 0; n < cloud->count; n++)
        cloud->at[n].weight *= factor;
}

void adaptive_cloud_look(struct adaptive_cloud *cloud, const struct nav_likelihood *l)
{
    uint8_t *codes = cloud->codes;
    for (long n = 0; n < cloud->count; n++, codes += l->whiskers) {
        struct adaptive_particle *p = &cloud->at[n];
        p->loglik = nav_likelihood_at(l, &(struct nav_place){p->pose.x, p->pose.y, p->c, p->s}, codes);
    }
}

void adaptive_cloud_expect(const struct adaptive_cloud *cloud, struct nav_likelihood *l, double mass)
{
    const uint8_t *codes = cloud->codes;
    nav_trust_begin(l);
    for (long n = 0; n < cloud->count; n++, codes += l->whiskers)
        nav_trust_add(l, codes, mass * cloud->at[n].weight);
}

double adaptive_cloud_weigh(struct adaptive_cloud *cloud, const struct nav_likelihood *l)
{
    double total = 0.0;
    float best = -INFINITY;
    for (long n = 0; n < cloud->count; n++)
        best = cloud->at[n].loglik > best ? cloud->at[n].loglik : best;
    for (long n = 0; n < cloud->count; n++) {
        struct adaptive_particle *p = &cloud->at[n];
        p->weight *= (double)expf(p->loglik - best);
        if (!nav_likelihood_clear(l, p->pose.x, p->pose.y, GRACE_M))
            p->weight *= BLOCKED;
        total += p->weight;
    }
    cloud->moved += cloud->count;
    adaptive_cloud_scale(cloud, 1.0 / total);
    return log(total) + (double)best;
}

static bool uneven(const struct adaptive_cloud *cloud)
{
    double squares = 0.0;
    for (long n = 0; n < cloud->count; n++)
        squares += cloud->at[n].weight * cloud->at[n].weight;
    return squares * (double)cloud->count > 2.0;
}

/* Bins of adaptive.bin_m and adaptive.bin_deg that hold a share of weight worth a hypothesis. */
static long occupied(struct adaptive_cloud *cloud)
{
    const struct nav_settings *s = &cloud->problem->settings;
    double per_m = 1.0 / s->adaptive_bin_m, per_rad = 180.0 / (NAV_PI * s->adaptive_bin_deg);
    double least = 0.1 / (double)cloud->count;
    long count = 0;
    cloud->visit++;
    for (long n = 0; n < cloud->count; n++) {
        const struct adaptive_particle *p = &cloud->at[n];
        if (p->weight < least)
            continue;
        uint32_t key = (uint32_t)(int32_t)floor(p->pose.x * per_m) * 73856093u ^
                       (uint32_t)(int32_t)floor(p->pose.y * per_m) * 19349663u ^
                       (uint32_t)(int32_t)floor(p->pose.theta * per_rad) * 83492791u;
        uint32_t *stamp = &cloud->stamp[(key ^ key >> 13) % BOOK];
        count += *stamp != cloud->visit;
        *stamp = cloud->visit;
    }
    return count;
}

void adaptive_cloud_thin(struct adaptive_cloud *cloud, bool force)
{
    if (cloud->count == 0 || !(force || uneven(cloud)))
        return;
    long count = needed(cloud, (double)occupied(cloud));
    double step = 1.0 / (double)count, mark = step * nav_rng_uniform(&cloud->rng), sum = 0.0;
    long taken = 0;
    for (long n = 0; n < cloud->count; n++) {
        sum += cloud->at[n].weight;
        for (; mark < sum && taken < count; mark += step) {
            cloud->spare[taken] = cloud->at[n];
            cloud->spare[taken++].weight = step;
        }
    }
    for (; taken < count; taken++) { /* the sum ended a rounding error short of 1 */
        cloud->spare[taken] = cloud->at[cloud->count - 1];
        cloud->spare[taken].weight = step;
    }
    struct adaptive_particle *drawn = cloud->spare;
    cloud->spare = cloud->at;
    cloud->at = drawn;
    cloud->moved += cloud->count;
    cloud->count = count;
}
