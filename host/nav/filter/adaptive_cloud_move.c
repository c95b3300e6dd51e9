/* Hypotheses as they are made and as they move: each guesses for itself how good the odometry is. */
#include <math.h>

#include "adaptive_cloud.h"

static const double MUTATION = 0.03, NUDGE = 0.2;

/* Fresh guesses of how good the odometry is: three in four hold it unbiased, half hold with the model's noise, the
 * others with half of it, as the model's allows for errors that persist, or with twice as much. */
static double gain_of(const struct adaptive_cloud *cloud, struct nav_rng *rng)
{
    return nav_rng_bits(rng) >> 62 ? 0.0 : cloud->problem->settings.adaptive_gain * nav_rng_rough(rng);
}

static double noise_of(struct nav_rng *rng)
{
    static const double LEVELS[] = {1.0, 0.5, 2.0, 5.0};
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
            p->gain += NUDGE * cloud->problem->settings.adaptive_gain * nav_rng_rough(rng);
        break;
    case 4:
    case 5:
        if (p->turn_gain != 0.0)
            p->turn_gain += NUDGE * cloud->problem->settings.adaptive_gain * nav_rng_rough(rng);
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

void adaptive_cloud_add(struct adaptive_cloud *cloud, struct nav_pose pose, double weight)
{
    if (cloud->count == cloud->room)
        return;
    struct adaptive_particle *p = &cloud->at[cloud->count++];
    *p = (struct adaptive_particle){.pose = pose, .weight = weight};
    p->gain = gain_of(cloud, &cloud->rng);
    p->turn_gain = gain_of(cloud, &cloud->rng);
    p->noise = noise_of(&cloud->rng);
    turn_to(p, pose.theta);
}

void adaptive_cloud_move(struct adaptive_cloud *cloud, struct nav_pose step, const struct nav_noise *noise, bool known)
{
    double position = sqrt(noise->position), heading = sqrt(noise->heading);
    for (long n = 0; n < cloud->count; n++) {
        struct adaptive_particle *p = &cloud->at[n];
        mutate(cloud, p, &cloud->rng);
        double level = known ? p->noise : fmax(p->noise, 1.0);
        double dx = (1.0 + p->gain) * step.x + level * position * nav_rng_rough(&cloud->rng);
        double dy = (1.0 + p->gain) * step.y + level * position * nav_rng_rough(&cloud->rng);
        double turn = (1.0 + p->turn_gain) * step.theta + level * heading * nav_rng_rough(&cloud->rng);
        p->pose.x += p->c * dx - p->s * dy;
        p->pose.y += p->s * dx + p->c * dy;
        turn_by(p, turn);
    }
    cloud->moved += cloud->count;
}
