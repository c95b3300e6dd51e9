/* What a cloud of hypotheses amounts to: the answer, its covariance, the belief as a list. */
#include <math.h>

#include "adaptive_cloud.h"

/* A mode with less mass than this is compared with others before it is the answer; so many of them. */
static const double MODE_LEAST = 0.4;
enum { CANDIDATES = 8, ROUNDS = 2 };

struct nav_pose adaptive_image(const struct nav_arena *arena, int images, int m, struct nav_pose pose)
{
    if (m == 0)
        return pose;
    double x = pose.x - arena->size_x / 2.0, y = pose.y - arena->size_y / 2.0;
    int quarters = 4 / images * m;
    static const int C[] = {1, 0, -1, 0}, S[] = {0, 1, 0, -1};
    return (struct nav_pose){arena->size_x / 2.0 + C[quarters] * x - S[quarters] * y,
                             arena->size_y / 2.0 + S[quarters] * x + C[quarters] * y,
                             adaptive_wrap(pose.theta + quarters * (NAV_PI / 2.0))};
}

struct sums {
    double mass, x, y, theta; /* offsets from the pose, times mass */
};

static void offset(struct nav_pose from, struct nav_pose to, double d[3])
{
    d[0] = to.x - from.x;
    d[1] = to.y - from.y;
    d[2] = adaptive_wrap(to.theta - from.theta);
}

/* Pose of a hypothesis in image m. */
static struct nav_pose pose_of(const struct adaptive_cloud *cloud, long n, int m)
{
    struct nav_pose pose = cloud->at[n].pose;
    return m == 0 ? pose : adaptive_image(&cloud->problem->arena, cloud->images, m, pose);
}

static struct sums near(const struct adaptive_cloud *cloud, struct nav_pose about)
{
    struct sums s = {.mass = 0.0};
    for (int m = 0; m < cloud->images; m++) {
        for (long n = 0; n < cloud->count; n++) {
            const struct adaptive_particle *p = &cloud->at[n];
            double d[3], mass = p->weight * (double)p->share[m];
            offset(about, pose_of(cloud, n, m), d);
            if (d[0] * d[0] + d[1] * d[1] > NAV_NEAR_M * NAV_NEAR_M || fabs(d[2]) > NAV_NEAR_RAD)
                continue;
            s.mass += mass;
            s.x += mass * d[0];
            s.y += mass * d[1];
            s.theta += mass * d[2];
        }
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

/* The heaviest of a few modes: hypotheses evenly spaced by weight, each in its likeliest image. */
static struct nav_pose search(const struct adaptive_cloud *cloud, struct nav_pose pose, double *mass)
{
    double sum = 0.0;
    int taken = 0;
    for (long n = 0; n < cloud->count && taken < CANDIDATES; n++) {
        const struct adaptive_particle *p = &cloud->at[n];
        sum += p->weight;
        if (sum * CANDIDATES < taken + 0.5)
            continue;
        taken++;
        int image = 0;
        for (int m = 1; m < cloud->images; m++)
            image = p->share[m] > p->share[image] ? m : image;
        double found;
        struct nav_pose other =
            settle(cloud, adaptive_image(&cloud->problem->arena, cloud->images, image, p->pose), &found);
        if (found > 1.01 * *mass) {
            pose = other;
            *mass = found;
        }
    }
    return pose;
}

static void covariance(const struct adaptive_cloud *cloud, struct nav_gaussian *g)
{
    for (int m = 0; m < cloud->images; m++) {
        for (long n = 0; n < cloud->count; n++) {
            const struct adaptive_particle *p = &cloud->at[n];
            double d[3], mass = p->weight * (double)p->share[m];
            if (!(mass > 0.0))
                continue;
            offset(g->mean, pose_of(cloud, n, m), d);
            for (int k = 0; k < 9; k++)
                g->covariance[k] += mass * d[k / 3] * d[k % 3];
        }
    }
}

struct adaptive_summary adaptive_cloud_summary(const struct adaptive_cloud *cloud, struct nav_pose guess)
{
    double mass;
    struct adaptive_summary out = {.near = 0.0};
    guess.theta = nav_wrap(guess.theta);
    out.belief.mean = settle(cloud, guess, &mass);
    if (mass * cloud->images < MODE_LEAST)
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
        if (d[0] * d[0] + d[1] * d[1] > NAV_NEAR_M * NAV_NEAR_M || fabs(d[2]) > NAV_NEAR_RAD)
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
    for (int m = 0; m < cloud->images; m++) {
        for (long n = 0; n < cloud->count; n++) {
            const struct adaptive_particle *p = &cloud->at[n];
            each.mass = mass * p->weight * (double)p->share[m];
            if (!(each.mass > 0.0))
                continue;
            each.pose = nav_compose(adaptive_image(&cloud->problem->arena, cloud->images, m, p->pose), moved);
            if (count < room)
                out[count] = each;
            count++;
        }
    }
    return count;
}
