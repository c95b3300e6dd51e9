#include "particles.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "bumps.h"

enum { TRIES = 64 };

int nav_particles_init(struct nav_particles *p, long room)
{
    *p = (struct nav_particles){.room = room, .memory = calloc(5 * (size_t)room, sizeof *p->memory)};
    if (!p->memory)
        return -1;
    p->x = p->memory;
    p->y = p->x + room;
    p->c = p->y + room;
    p->s = p->c + room;
    p->weight = p->s + room;
    return 0;
}

void nav_particles_free(struct nav_particles *p)
{
    free(p->memory);
}

static struct nav_pose draw_once(const struct nav_arena *arena, const struct nav_prior *prior, struct nav_rng *rng)
{
    struct nav_pose pose;
    bool mixture = nav_bumps_given(prior);
    if (mixture && nav_rng_uniform(rng) >= NAV_ANYWHERE)
        return nav_bumps_draw(prior, rng);
    if (prior->uniform || mixture) {
        pose.x = arena->size_x * nav_rng_uniform(rng);
        pose.y = arena->size_y * nav_rng_uniform(rng);
        pose.theta = 2.0 * NAV_PI * nav_rng_uniform(rng) - NAV_PI;
        return pose;
    }
    pose.x = prior->mean.x + prior->sigma[0] * nav_rng_normal(rng);
    pose.y = prior->mean.y + prior->sigma[1] * nav_rng_normal(rng);
    pose.theta = prior->mean.theta + prior->sigma[2] * nav_rng_normal(rng);
    return pose;
}

struct nav_pose nav_particles_draw(const struct nav_likelihood *l, const struct nav_prior *prior, struct nav_rng *rng)
{
    struct nav_pose pose = draw_once(l->arena, prior, rng);
    for (int n = 1; n < TRIES && !nav_likelihood_clear(l, pose.x, pose.y, 0.0); n++)
        pose = draw_once(l->arena, prior, rng);
    return pose;
}

void nav_particles_set(struct nav_particles *p, long i, struct nav_pose pose)
{
    p->x[i] = (float)pose.x;
    p->y[i] = (float)pose.y;
    p->c[i] = (float)cos(pose.theta);
    p->s[i] = (float)sin(pose.theta);
}

/* Turns unit vector (c, s) by an angle; a polynomial does for small ones, and the length is put right. */
static void turn(float *c, float *s, float angle)
{
    float co, si, square = angle * angle;
    if (square < 0.02f) {
        co = 1.0f - square * (0.5f - square / 24.0f);
        si = angle * (1.0f - square / 6.0f);
    } else {
        co = cosf(angle);
        si = sinf(angle);
    }
    float a = *c * co - *s * si, b = *s * co + *c * si, mend = 1.5f - 0.5f * (a * a + b * b);
    *c = a * mend;
    *s = b * mend;
}

void nav_particles_move(struct nav_particles *p, struct nav_pose step, const struct nav_noise *noise,
                        struct nav_rng *rng)
{
    float dx = (float)step.x, dy = (float)step.y, co = (float)cos(step.theta), si = (float)sin(step.theta);
    float sigma = (float)sqrt(noise->position), sigma_turn = (float)fmin(sqrt(noise->heading), NAV_PI);
    for (long i = 0; i < p->count; i++) {
        float c = p->c[i], s = p->s[i];
        p->x[i] += c * dx - s * dy + sigma * (float)nav_rng_rough(rng);
        p->y[i] += s * dx + c * dy + sigma * (float)nav_rng_rough(rng);
        p->c[i] = c * co - s * si;
        p->s[i] = s * co + c * si;
        turn(&p->c[i], &p->s[i], sigma_turn * (float)nav_rng_rough(rng));
    }
}

double nav_particles_weigh(struct nav_particles *p, const struct nav_likelihood *l, float *loglik)
{
    float best = -INFINITY;
    for (long i = 0; i < p->count; i++) {
        const struct nav_place at = {(double)p->x[i], (double)p->y[i], (double)p->c[i], (double)p->s[i]};
        loglik[i] = (float)nav_likelihood_standing(l, &at);
        if (p->weight[i] > 0.0f && loglik[i] > best)
            best = loglik[i];
    }
    if (!(best > -INFINITY))
        return 0.0;
    double total = 0.0;
    for (long i = 0; i < p->count; i++)
        total += (double)(loglik[i] = p->weight[i] * expf(loglik[i] - best));
    if (!(total > 0.0))
        return 0.0;
    for (long i = 0; i < p->count; i++)
        p->weight[i] = loglik[i] * (float)(1.0 / total);
    return total * exp((double)best - l->ceiling);
}

double nav_particles_effective(const struct nav_particles *p)
{
    double sum = 0.0, square = 0.0;
    for (long i = 0; i < p->count; i++) {
        sum += (double)p->weight[i];
        square += (double)p->weight[i] * (double)p->weight[i];
    }
    return square > 0.0 ? sum * sum / square : 0.0;
}

static void copy_one(const struct nav_particles *from, long i, struct nav_particles *to, long k)
{
    to->x[k] = from->x[i];
    to->y[k] = from->y[i];
    to->c[k] = from->c[i];
    to->s[k] = from->s[i];
    to->weight[k] = 1.0f / (float)to->count;
}

void nav_particles_resample(const struct nav_particles *from, struct nav_particles *to, long count, double offset)
{
    double total = 0.0, passed = 0.0;
    for (long i = 0; i < from->count; i++)
        total += (double)from->weight[i];
    long i = 0;
    to->count = count;
    for (long k = 0; k < count; k++) {
        double mark = ((double)k + offset) / (double)count * total;
        while (i + 1 < from->count && passed + (double)from->weight[i] <= mark)
            passed += (double)from->weight[i++];
        copy_one(from, i, to, k);
    }
}

struct nav_pose nav_particles_mean(const struct nav_particles *p)
{
    double x = 0.0, y = 0.0, c = 0.0, s = 0.0, total = 0.0;
    for (long i = 0; i < p->count; i++) {
        double w = (double)p->weight[i];
        total += w;
        x += w * (double)p->x[i];
        y += w * (double)p->y[i];
        c += w * (double)p->c[i];
        s += w * (double)p->s[i];
    }
    return (struct nav_pose){x / total, y / total, atan2(s, c)};
}

/* Angle from one unit vector to another; a series does for what is near. */
static float angle_between(float c0, float s0, float c, float s)
{
    float across = c0 * s - s0 * c, along = c0 * c + s0 * s, square = across * across;
    if (along > 0.9f)
        return across * (1.0f + square * (1.0f / 6.0f + square * (3.0f / 40.0f)));
    return atan2f(across, along);
}

double nav_particles_near(const struct nav_particles *p, struct nav_pose pose, struct nav_pose *mean)
{
    static const float NEAR_COSINE = 0.8775825619f; /* cos(NAV_NEAR_RAD) */
    float c0 = (float)cos(pose.theta), s0 = (float)sin(pose.theta), x0 = (float)pose.x, y0 = (float)pose.y;
    double mass = 0.0, x = 0.0, y = 0.0, turned = 0.0;
    for (long i = 0; i < p->count; i++) {
        float dx = p->x[i] - x0, dy = p->y[i] - y0;
        if (dx * dx + dy * dy > (float)(NAV_NEAR_M * NAV_NEAR_M) || c0 * p->c[i] + s0 * p->s[i] < NEAR_COSINE)
            continue;
        mass += (double)p->weight[i];
        x += (double)(p->weight[i] * dx);
        y += (double)(p->weight[i] * dy);
        turned += (double)(p->weight[i] * angle_between(c0, s0, p->c[i], p->s[i]));
    }
    *mean = pose;
    if (mass > 0.0)
        *mean = (struct nav_pose){pose.x + x / mass, pose.y + y / mass, nav_wrap(pose.theta + turned / mass)};
    return mass;
}

void nav_particles_covariance(const struct nav_particles *p, struct nav_pose about, double covariance[9])
{
    float c0 = (float)cos(about.theta), s0 = (float)sin(about.theta);
    double sum[6] = {0.0}; /* xx xy xt yy yt tt */
    for (long i = 0; i < p->count; i++) {
        double w = (double)p->weight[i], x = (double)p->x[i] - about.x, y = (double)p->y[i] - about.y;
        double t = (double)angle_between(c0, s0, p->c[i], p->s[i]);
        sum[0] += w * x * x;
        sum[1] += w * x * y;
        sum[2] += w * x * t;
        sum[3] += w * y * y;
        sum[4] += w * y * t;
        sum[5] += w * t * t;
    }
    const double all[9] = {sum[0], sum[1], sum[2], sum[1], sum[3], sum[4], sum[2], sum[4], sum[5]};
    memcpy(covariance, all, sizeof all);
}
