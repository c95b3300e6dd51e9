#include "adaptive_cloud.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { BOOK = 8192, TRIES = 20 };

/* The body radius and the walls' places are no better known than this. */
static const double GRACE_M = 0.01;
/* Likelihood of standing where the map says one cannot: maps are wrong sometimes. */
static const double BLOCKED = 0.001;
static const double MUTATION = 0.03, NUDGE = 0.2;
/* Chances per row: wheels begin to spin while the robot stands, or to skid, so that odometry errs by SKIDDING times its
 * noise; both last some ten rows. So that some hypotheses always stand ready, OFTEN times as many try it, and weigh as
 * much less. */
static const double SPIN = 0.0005, SKID = 0.0002, GRIP = 0.1, SKIDDING = 8.0, OFTEN = 4.0;

long adaptive_cloud_room(const struct nav_settings *s)
{
    return (long)fmax(fmin(s->adaptive_most, s->adaptive_budget / 10.0), 16.0);
}

int adaptive_cloud_init(struct adaptive_cloud *cloud, const struct nav_problem *problem)
{
    *cloud = (struct adaptive_cloud){.problem = problem, .images = 1, .room = adaptive_cloud_room(&problem->settings)};
    nav_rng_seed(&cloud->rng, problem->seed, 0);
    cloud->at = calloc((size_t)cloud->room, sizeof *cloud->at);
    cloud->spare = calloc((size_t)cloud->room, sizeof *cloud->spare);
    cloud->stamp = calloc(BOOK, sizeof *cloud->stamp);
    return cloud->at && cloud->spare && cloud->stamp ? 0 : -1;
}

void adaptive_cloud_free(struct adaptive_cloud *cloud)
{
    free(cloud->at);
    free(cloud->spare);
    free(cloud->stamp);
}

double adaptive_normal(struct nav_rng *rng)
{
    uint64_t bits = nav_rng_bits(rng);
    double sum =
        (double)(bits & 0xffff) + (double)(bits >> 16 & 0xffff) + (double)(bits >> 32 & 0xffff) + (double)(bits >> 48);
    /* Four uniform numbers of 0 .. 65535: mean 131070, variance (65536^2 - 1) / 3. */
    return (sum - 131070.0) * (1.0 / 37837.22);
}

/* Fresh guesses of how good the odometry is: three in four hold it unbiased, half hold with the model's noise and half
 * with less, as the model's allows for errors that persist. */
static double gain_of(const struct adaptive_cloud *cloud, struct nav_rng *rng)
{
    return nav_rng_bits(rng) >> 62 ? 0.0 : cloud->problem->settings.adaptive_gain * adaptive_normal(rng);
}

static double noise_of(struct nav_rng *rng)
{
    static const double LEVELS[] = {1.0, 0.5, 0.25, 1.0};
    return LEVELS[nav_rng_bits(rng) >> 62];
}

/* Changes one guess of one hypothesis now and then; those whose guesses fit outlive the others. */
static void mutate(const struct adaptive_cloud *cloud, struct adaptive_particle *p, struct nav_rng *rng)
{
    uint64_t bits = nav_rng_bits(rng);
    if ((double)(bits >> 11) * 0x1p-53 >= MUTATION)
        return;
    switch (bits & 7) {
    case 0:
        p->gain = gain_of(cloud, rng);
        break;
    case 1:
        p->turn_gain = gain_of(cloud, rng);
        break;
    case 2:
    case 3:
        if (p->gain != 0.0)
            p->gain += NUDGE * cloud->problem->settings.adaptive_gain * adaptive_normal(rng);
        break;
    case 4:
    case 5:
        if (p->turn_gain != 0.0)
            p->turn_gain += NUDGE * cloud->problem->settings.adaptive_gain * adaptive_normal(rng);
        break;
    default:
        p->noise = noise_of(rng);
    }
}

/* Turns by an angle: small ones by a series whose error is below 1e-11, and no drift of the vector's length. */
static void turn_by(struct adaptive_particle *p, double turn)
{
    p->pose.theta = adaptive_wrap(p->pose.theta + turn);
    if (fabs(turn) > 0.3) {
        p->c = cos(p->pose.theta);
        p->s = sin(p->pose.theta);
        return;
    }
    double q = turn * turn;
    double ct = 1.0 - q / 2.0 * (1.0 - q / 12.0 * (1.0 - q / 30.0 * (1.0 - q / 56.0)));
    double st = turn * (1.0 - q / 6.0 * (1.0 - q / 20.0 * (1.0 - q / 42.0 * (1.0 - q / 72.0))));
    double c = p->c * ct - p->s * st, s = p->s * ct + p->c * st, length = 1.5 - 0.5 * (c * c + s * s);
    p->c = c * length;
    p->s = s * length;
}

static void turn_to(struct adaptive_particle *p, double theta)
{
    p->pose.theta = adaptive_wrap(theta);
    p->c = cos(p->pose.theta);
    p->s = sin(p->pose.theta);
}

void adaptive_cloud_add(struct adaptive_cloud *cloud, struct nav_pose pose, double weight, const float *share)
{
    if (cloud->count == cloud->room)
        return;
    struct adaptive_particle *p = &cloud->at[cloud->count++];
    *p = (struct adaptive_particle){.pose = pose, .weight = weight};
    p->gain = gain_of(cloud, &cloud->rng);
    p->turn_gain = gain_of(cloud, &cloud->rng);
    p->noise = noise_of(&cloud->rng);
    memcpy(p->share, share, sizeof p->share);
    turn_to(p, pose.theta);
}

/* How many hypotheses a number of occupied bins needs. */
static long needed(const struct adaptive_cloud *cloud, double bins)
{
    const struct nav_settings *s = &cloud->problem->settings;
    return (long)fmin(fmax(bins * s->adaptive_per_bin, s->adaptive_least), (double)cloud->room);
}

bool adaptive_cloud_prior(struct adaptive_cloud *cloud, const struct adaptive_sense *sense)
{
    const struct nav_prior *prior = &cloud->problem->prior;
    const struct nav_settings *s = &cloud->problem->settings;
    static const float FIRST[ADAPTIVE_IMAGES_MOST] = {1.0f};
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
        if (adaptive_sense_free_at(sense, pose.x, pose.y, GRACE_M))
            adaptive_cloud_add(cloud, pose, 1.0, FIRST);
    }
    adaptive_cloud_scale(cloud, 1.0 / fmax((double)cloud->count, 1.0));
    return cloud->count > 0;
}

void adaptive_cloud_scale(struct adaptive_cloud *cloud, double factor)
{
    for (long n = 0; n < cloud->count; n++)
        cloud->at[n].weight *= factor;
}

static void drive_on(struct adaptive_particle *p, struct nav_rng *rng)
{
    double chance = (double)(nav_rng_bits(rng) >> 11) * 0x1p-53;
    if (p->drive == ADAPTIVE_ROLLS && chance < OFTEN * (SPIN + SKID)) {
        p->drive = chance < OFTEN * SPIN ? ADAPTIVE_SPINS : ADAPTIVE_SKIDS;
        p->weight /= OFTEN;
    } else if (p->drive != ADAPTIVE_ROLLS && chance < GRIP) {
        p->drive = ADAPTIVE_ROLLS;
    }
}

void adaptive_cloud_move(struct adaptive_cloud *cloud, struct nav_pose step, const struct nav_noise *noise, bool known)
{
    double position = sqrt(noise->position), heading = sqrt(noise->heading);
    for (long n = 0; n < cloud->count; n++) {
        struct adaptive_particle *p = &cloud->at[n];
        mutate(cloud, p, &cloud->rng);
        drive_on(p, &cloud->rng);
        double goes = p->drive == ADAPTIVE_SPINS ? 0.0 : 1.0;
        double level = p->drive == ADAPTIVE_SKIDS ? SKIDDING : known ? p->noise : fmax(p->noise, 1.0);
        double dx = goes * (1.0 + p->gain) * step.x + level * position * adaptive_normal(&cloud->rng);
        double dy = goes * (1.0 + p->gain) * step.y + level * position * adaptive_normal(&cloud->rng);
        double turn = goes * (1.0 + p->turn_gain) * step.theta + level * heading * adaptive_normal(&cloud->rng);
        p->pose.x += p->c * dx - p->s * dy;
        p->pose.y += p->s * dx + p->c * dy;
        turn_by(p, turn);
    }
    cloud->moved += cloud->count;
}

void adaptive_cloud_look(struct adaptive_cloud *cloud, struct adaptive_sense *sense)
{
    for (long n = 0; n < cloud->count; n++) {
        struct adaptive_particle *p = &cloud->at[n];
        p->slot = adaptive_sense_at(sense, p->pose.x, p->pose.y, p->c, p->s);
    }
}

void adaptive_cloud_expect(const struct adaptive_cloud *cloud, struct adaptive_sense *sense, double mass)
{
    for (long n = 0; n < sense->distinct; n++)
        sense->mass[sense->filled[n]] = 0.0;
    for (long n = 0; n < cloud->count; n++)
        sense->mass[cloud->at[n].slot] += cloud->at[n].weight;
    nav_trust_begin(sense->likelihood);
    for (long n = 0; n < sense->distinct; n++) {
        uint32_t slot = sense->filled[n];
        const uint8_t *codes = sense->codes + slot * (size_t)sense->likelihood->whiskers;
        nav_trust_add(sense->likelihood, codes, mass * sense->mass[slot]);
    }
}

/* Likelihoods of the row's signatures relative to the best; returns the best's logarithm. */
static double factors(struct adaptive_sense *sense)
{
    float best = -INFINITY;
    for (long n = 0; n < sense->distinct; n++)
        best = fmaxf(best, sense->value[sense->filled[n]]);
    for (long n = 0; n < sense->distinct; n++) {
        uint32_t slot = sense->filled[n];
        sense->mass[slot] = exp((double)(sense->value[slot] - best));
    }
    return (double)best;
}

double adaptive_cloud_weigh(struct adaptive_cloud *cloud, struct adaptive_sense *sense)
{
    double best = factors(sense), total = 0.0;
    for (long n = 0; n < cloud->count; n++) {
        struct adaptive_particle *p = &cloud->at[n];
        p->weight *= sense->mass[p->slot];
        if (!adaptive_sense_free_at(sense, p->pose.x, p->pose.y, GRACE_M))
            p->weight *= BLOCKED;
        total += p->weight;
    }
    cloud->moved += cloud->count;
    adaptive_cloud_scale(cloud, 1.0 / total);
    return log(total) + best;
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
