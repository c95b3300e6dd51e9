/* What particles amount to: moments, modes, and the belief as a list. */
#include <math.h>
#include <string.h>

#include "particles.h"

static const struct nav_pose STILL = {0.0, 0.0, 0.0};
/* m and rad, of one particle: few may all be alike, and nobody knows the pose better. */
static const double FINEST = 1e-3;

/* Angle from one unit vector to another; a series does for what is near. */
static float moments_angle(float c0, float s0, float c, float s)
{
    float across = c0 * s - s0 * c, along = c0 * c + s0 * s, square = across * across;
    if (along > 0.9f)
        return across * (1.0f + square * (1.0f / 6.0f + square * (3.0f / 40.0f)));
    return atan2f(across, along);
}

/* Sums over particles, moved by `step`, of weight, offset from a pose and products of offsets: all of them, or those
 * near it. */
struct particle_sums {
    double mass, first[3], second[6]; /* x y t; xx xy xt yy yt tt */
};

static struct particle_sums moments_sum(const struct nav_particles *p, struct nav_pose step, struct nav_pose about,
                                        bool all)
{
    const float near_cosine = (float)cos(NAV_NEAR_RAD), dx = (float)step.x, dy = (float)step.y;
    double turn = about.theta - step.theta;
    float c0 = (float)cos(turn), s0 = (float)sin(turn), x0 = (float)about.x, y0 = (float)about.y;
    struct particle_sums sum = {.mass = 0.0};
    for (long i = 0; i < p->count; i++) {
        float x = p->x[i] - x0 + p->c[i] * dx - p->s[i] * dy, y = p->y[i] - y0 + p->s[i] * dx + p->c[i] * dy;
        if (!all && (x * x + y * y > (float)(NAV_NEAR_M * NAV_NEAR_M) || c0 * p->c[i] + s0 * p->s[i] < near_cosine))
            continue;
        float t = moments_angle(c0, s0, p->c[i], p->s[i]), w = p->weight[i];
        const float first[3] = {w * x, w * y, w * t};
        const float second[6] = {w * x * x, w * x * y, w * x * t, w * y * y, w * y * t, w * t * t};
        sum.mass += (double)w;
        for (int k = 0; k < 3; k++)
            sum.first[k] += (double)first[k];
        for (int k = 0; k < 6; k++)
            sum.second[k] += (double)second[k];
    }
    return sum;
}

double nav_particles_near(const struct nav_particles *p, struct nav_pose pose, struct nav_pose *mean)
{
    struct particle_sums sum = moments_sum(p, STILL, pose, false);
    *mean = pose;
    if (sum.mass > 0.0)
        *mean = (struct nav_pose){pose.x + sum.first[0] / sum.mass, pose.y + sum.first[1] / sum.mass,
                                  nav_wrap(pose.theta + sum.first[2] / sum.mass)};
    return sum.mass;
}

void nav_particles_covariance(const struct nav_particles *p, const struct nav_pending *pending, struct nav_pose about,
                              double covariance[9])
{
    struct particle_sums sum = moments_sum(p, pending->step, about, true);
    const double *second = sum.second;
    for (int i = 0; i < 3; i++) {
        for (int k = i; k < 3; k++)
            covariance[3 * i + k] = covariance[3 * k + i] = *second++;
    }
    covariance[0] += FINEST * FINEST + pending->noise.position;
    covariance[4] += FINEST * FINEST + pending->noise.position;
    covariance[8] += FINEST * FINEST + pending->noise.heading;
}

int nav_particles_modes(struct nav_particles *p, struct nav_mode mode[NAV_MODES_MOST])
{
    int modes = 0;
    for (long i = 0; i < p->count; i++)
        p->mode[i] = -1.0f;
    for (long i = 0; i < p->count && modes < NAV_MODES_MOST; i++) {
        if (p->mode[i] >= 0.0f)
            continue;
        struct nav_mode *m = &mode[modes];
        nav_particles_near(p, nav_particles_pose(p, i), &m->mean);
        nav_particles_near(p, m->mean, &m->mean);
        m->mass = 0.0;
        for (long k = i; k < p->count; k++) {
            bool within = k == i || nav_mode_distance(m->mean, nav_particles_pose(p, k)) <= NAV_MODE_REACH;
            if (p->mode[k] >= 0.0f || !within)
                continue;
            p->mode[k] = (float)modes;
            m->mass += (double)p->weight[k];
        }
        modes++;
    }
    return modes;
}

void nav_particles_masses(const struct nav_particles *p, double *mass, int modes)
{
    memset(mass, 0, (size_t)modes * sizeof *mass);
    for (long i = 0; i < p->count; i++) {
        int mode = (int)p->mode[i];
        if (mode >= 0 && mode < modes)
            mass[mode] += (double)p->weight[i];
    }
}

static double moments_factor(const struct nav_particles *p, long i, const double *factor, int modes)
{
    int mode = (int)p->mode[i];
    return mode >= 0 && mode < modes ? factor[mode] : 1.0;
}

void nav_particles_weigh_modes(struct nav_particles *p, const double *factor, int modes)
{
    double total = 0.0;
    for (long i = 0; i < p->count; i++)
        total += (double)p->weight[i] * moments_factor(p, i, factor, modes);
    for (long i = 0; i < p->count && total > 0.0; i++)
        p->weight[i] = (float)((double)p->weight[i] * moments_factor(p, i, factor, modes) / total);
}

/* One particle as a component, its mass alone left open: the kernel's width is the normal reference rule's, on what is
 * near. */
static struct nav_component moments_kernel(const struct nav_particles *p, struct nav_pose about,
                                           const struct nav_pending *pending)
{
    struct nav_pose mean;
    nav_particles_near(p, about, &mean);
    struct particle_sums sum = moments_sum(p, STILL, mean, false);
    double shrink = pow((double)p->count, -1.0 / 6.0) / sqrt(fmax(sum.mass, 1e-12));
    struct nav_component each = {.sigma_m = shrink * sqrt((sum.second[0] + sum.second[3]) / 2.0),
                                 .sigma_rad = shrink * sqrt(sum.second[5])};
    each.sigma_m = hypot(fmax(each.sigma_m, FINEST), sqrt(pending->noise.position));
    each.sigma_rad = hypot(fmax(each.sigma_rad, FINEST), sqrt(pending->noise.heading));
    return each;
}

double nav_particles_within(const struct nav_particles *p, struct nav_pose about, const struct nav_pending *pending,
                            struct nav_pose pose)
{
    const struct nav_component each = moments_kernel(p, about, pending);
    float c0 = (float)cos(pose.theta - pending->step.theta), s0 = (float)sin(pose.theta - pending->step.theta);
    double within = 0.0, total = 0.0;
    for (long i = 0; i < p->count; i++) {
        double c = (double)p->c[i], s = (double)p->s[i], weight = (double)p->weight[i];
        double x = (double)p->x[i] + c * pending->step.x - s * pending->step.y - pose.x;
        double y = (double)p->y[i] + s * pending->step.x + c * pending->step.y - pose.y;
        double turn = (double)moments_angle(c0, s0, p->c[i], p->s[i]);
        within += weight * nav_component_near(x * x + y * y, turn, each.sigma_m, each.sigma_rad);
        total += weight;
    }
    return within / total;
}

long nav_particles_components(const struct nav_particles *p, struct nav_pose about, const struct nav_pending *pending,
                              double mass, struct nav_component *out, long room)
{
    struct nav_component each = moments_kernel(p, about, pending);
    double total = 0.0;
    for (long i = 0; i < p->count; i++)
        total += (double)p->weight[i];
    long count = 0;
    for (long i = 0; i < p->count; i++) {
        each.mass = mass * (double)p->weight[i] / total;
        if (!(each.mass > 0.0))
            continue;
        each.pose = nav_compose(nav_particles_pose(p, i), pending->step);
        each.pose.theta = nav_wrap(each.pose.theta);
        if (count < room)
            out[count] = each;
        count++;
    }
    return count;
}
