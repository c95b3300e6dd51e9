/* What a cloud of hypotheses amounts to: the answer, its covariance, the belief as a list. */
#include <math.h>

#include "adaptive_cloud.h"

/* A mode with less mass than this is compared with others before it is the answer; so many of them. */
static const double MODE_LEAST = 0.4;
enum { CANDIDATES = 8, ROUNDS = 2 };

struct sums {
    double mass, x, y, theta; /* offsets from the pose, times mass */
};

static void offset(struct nav_pose from, struct nav_pose to, double d[3])
{
    d[0] = to.x - from.x;
    d[1] = to.y - from.y;
    d[2] = adaptive_wrap(to.theta - from.theta);
}

static bool is_near(const double d[3])
{
    return d[0] * d[0] + d[1] * d[1] <= NAV_NEAR_M * NAV_NEAR_M && fabs(d[2]) <= NAV_NEAR_RAD;
}

static struct sums near(const struct adaptive_cloud *cloud, struct nav_pose about)
{
    struct sums s = {.mass = 0.0};
    for (long n = 0; n < cloud->count; n++) {
        const struct adaptive_particle *p = &cloud->at[n];
        double d[3];
        offset(about, p->pose, d);
        if (!is_near(d))
            continue;
        s.mass += p->weight;
        s.x += p->weight * d[0];
        s.y += p->weight * d[1];
        s.theta += p->weight * d[2];
    }
    return s;
}

/* Mean of what is near a pose, repeated; `mass` is what was near at last. */
static struct nav_pose settle(const struct adaptive_cloud *cloud, struct nav_pose pose, double *mass)
{
    for (int round = 0; round < ROUNDS; round++) {
        struct sums s = near(cloud, pose);
        *mass = s.mass;
        if (s.mass > 0.0)
            pose = (struct nav_pose){pose.x + s.x / s.mass, pose.y + s.y / s.mass,
                                     adaptive_wrap(pose.theta + s.theta / s.mass)};
    }
    return pose;
}

/* The heaviest of a few modes: hypotheses evenly spaced by weight. */
static struct nav_pose search(const struct adaptive_cloud *cloud, struct nav_pose pose, double *mass)
{
    double sum = 0.0;
    int taken = 0;
    for (long n = 0; n < cloud->count && taken < CANDIDATES; n++) {
        sum += cloud->at[n].weight;
        if (sum * CANDIDATES < taken + 0.5)
            continue;
        taken++;
        double found;
        struct nav_pose other = settle(cloud, cloud->at[n].pose, &found);
        if (found > 1.01 * *mass) {
            pose = other;
            *mass = found;
        }
    }
    return pose;
}

double adaptive_mode_distance(struct nav_pose mean, struct nav_pose pose)
{
    double dx = pose.x - mean.x, dy = pose.y - mean.y, turn = nav_wrap(pose.theta - mean.theta);
    return (dx * dx + dy * dy) / (NAV_NEAR_M * NAV_NEAR_M) + turn * turn / (NAV_NEAR_RAD * NAV_NEAR_RAD);
}

int adaptive_cloud_modes(struct adaptive_cloud *cloud, struct adaptive_mode mode[ADAPTIVE_MODES_MOST])
{
    int modes = 0;
    for (long n = 0; n < cloud->count; n++)
        cloud->at[n].mode = -1;
    for (long n = 0; n < cloud->count && modes < ADAPTIVE_MODES_MOST; n++) {
        if (cloud->at[n].mode >= 0)
            continue;
        struct adaptive_mode *m = &mode[modes];
        m->mean = settle(cloud, cloud->at[n].pose, &m->mass);
        m->mass = 0.0;
        for (long k = 0; k < cloud->count; k++) {
            if (cloud->at[k].mode >= 0 ||
                (k != n && adaptive_mode_distance(m->mean, cloud->at[k].pose) > ADAPTIVE_MODE_REACH))
                continue;
            cloud->at[k].mode = modes;
            m->mass += cloud->at[k].weight;
        }
        modes++;
    }
    return modes;
}

void adaptive_cloud_masses(const struct adaptive_cloud *cloud, double *mass, int modes)
{
    for (int m = 0; m < modes; m++)
        mass[m] = 0.0;
    for (long n = 0; n < cloud->count; n++) {
        if (cloud->at[n].mode >= 0 && cloud->at[n].mode < modes)
            mass[cloud->at[n].mode] += cloud->at[n].weight;
    }
}

void adaptive_cloud_weigh_modes(struct adaptive_cloud *cloud, const double *factor, int modes, double rest)
{
    double total = 0.0;
    for (long n = 0; n < cloud->count; n++) {
        struct adaptive_particle *p = &cloud->at[n];
        p->weight *= p->mode >= 0 && p->mode < modes ? factor[p->mode] : rest;
        total += p->weight;
    }
    adaptive_cloud_scale(cloud, 1.0 / total);
}

static void covariance(const struct adaptive_cloud *cloud, struct nav_gaussian *g)
{
    for (long n = 0; n < cloud->count; n++) {
        double d[3];
        offset(g->mean, cloud->at[n].pose, d);
        for (int k = 0; k < 9; k++)
            g->covariance[k] += cloud->at[n].weight * d[k / 3] * d[k % 3];
    }
}

struct adaptive_summary adaptive_cloud_summary(const struct adaptive_cloud *cloud, struct nav_pose guess)
{
    double mass;
    struct adaptive_summary out = {.near = 0.0};
    guess.theta = nav_wrap(guess.theta);
    out.belief.mean = settle(cloud, guess, &mass);
    if (mass < MODE_LEAST)
        out.belief.mean = search(cloud, out.belief.mean, &mass);
    out.near = fmin(mass, 1.0);
    covariance(cloud, &out.belief);
    return out;
}

/* Width of the bump that stands for a hypothesis: a normal reference rule, on what is near the heaviest one's. */
static struct nav_component bump(const struct adaptive_cloud *cloud)
{
    double mass;
    struct nav_component out = {.mass = 0.0};
    struct nav_pose mean = settle(cloud, cloud->at[cloud->count / 2].pose, &mass);
    double xy = 0.0, turn = 0.0, sum = 0.0;
    for (long n = 0; n < cloud->count; n++) {
        double d[3];
        offset(mean, cloud->at[n].pose, d);
        if (!is_near(d))
            continue;
        sum += cloud->at[n].weight;
        xy += cloud->at[n].weight * (d[0] * d[0] + d[1] * d[1]) / 2.0;
        turn += cloud->at[n].weight * d[2] * d[2];
    }
    double shrink = pow((double)cloud->count, -1.0 / 6.0);
    out.sigma_m = shrink * sqrt(xy / fmax(sum, 1e-12));
    out.sigma_rad = shrink * sqrt(turn / fmax(sum, 1e-12));
    return out;
}

long adaptive_cloud_list(const struct adaptive_cloud *cloud, struct nav_pose moved, double mass,
                         struct nav_component *out, long room)
{
    struct nav_component each = bump(cloud);
    long count = 0;
    for (long n = 0; n < cloud->count; n++) {
        each.mass = mass * cloud->at[n].weight;
        if (!(each.mass > 0.0))
            continue;
        each.pose = nav_compose(cloud->at[n].pose, moved);
        if (count < room)
            out[count] = each;
        count++;
    }
    return count;
}
