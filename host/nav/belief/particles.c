#include "particles.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "mixture.h"

/* Poses that show which places of the map a row is about. */
enum { MAP_POSES = 8 };

enum { TRIES = 64 };

/* Columns of all particles, and more of those that estimate the odometry's errors. */
enum { X, Y, C, S, WEIGHT, PLAIN, GAIN = PLAIN, TURN_GAIN, NOISE, MODE, WITH_ODOMETRY };

/* Log-likelihood of a particle where the robot cannot stand: below that of any row, and finite, so that particles all
 * of which are blocked keep their weights. */
static const float BLOCKED = -1e4f;

/* Chance per row that a particle draws one of its guesses anew, and how far a gain then moves by its prior's spread. */
static const double MUTATION = 0.03, NUDGE = 0.2;

static void particles_point(struct nav_particles *p)
{
    float **column[WITH_ODOMETRY] = {[X] = &p->x,
                                     [Y] = &p->y,
                                     [C] = &p->c,
                                     [S] = &p->s,
                                     [WEIGHT] = &p->weight,
                                     [GAIN] = &p->gain,
                                     [TURN_GAIN] = &p->turn_gain,
                                     [NOISE] = &p->noise,
                                     [MODE] = &p->mode};
    for (int k = 0; k < p->columns; k++)
        *column[k] = p->memory + (size_t)k * (size_t)p->room;
}

int nav_particles_init(struct nav_particles *p, long room, bool odometry, double spread)
{
    *p = (struct nav_particles){.room = room, .columns = odometry ? WITH_ODOMETRY : PLAIN, .spread = (float)spread};
    p->memory = calloc((size_t)p->columns * (size_t)room, sizeof *p->memory);
    p->spare = calloc((size_t)p->columns * (size_t)room, sizeof *p->spare);
    p->loglik = calloc((size_t)room, sizeof *p->loglik);
    if (!p->memory || !p->spare || !p->loglik)
        return -1;
    particles_point(p);
    return 0;
}

void nav_particles_free(struct nav_particles *p)
{
    free(p->memory);
    free(p->spare);
    free(p->loglik);
}

size_t nav_particles_bytes(const struct nav_particles *p)
{
    return (2 * (size_t)p->columns + 1) * (size_t)p->room * sizeof *p->memory;
}

static struct nav_pose particles_draw_once(const struct nav_arena *arena, const struct nav_prior *prior,
                                           double anywhere, struct nav_rng *rng)
{
    struct nav_pose pose;
    bool mixture = nav_mixture_given(prior);
    if (mixture && nav_rng_uniform(rng) >= anywhere)
        return nav_mixture_draw(prior, rng);
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

bool nav_particles_draw(const struct nav_likelihood *l, const struct nav_prior *prior, double anywhere,
                        struct nav_rng *rng, struct nav_pose *pose)
{
    for (int n = 0; n < TRIES; n++) {
        *pose = particles_draw_once(l->arena, prior, anywhere, rng);
        if (!nav_likelihood_clear(l, pose->x, pose->y, 0.0))
            continue;
        double share = prior->uniform ? nav_likelihood_prior(l, pose->x, pose->y) : 1.0;
        if (share >= 1.0 || nav_rng_uniform(rng) < share)
            return true;
    }
    return false;
}

void nav_particles_set(struct nav_particles *p, long i, struct nav_pose pose)
{
    p->x[i] = (float)pose.x;
    p->y[i] = (float)pose.y;
    p->c[i] = (float)cos(pose.theta);
    p->s[i] = (float)sin(pose.theta);
}

struct nav_pose nav_particles_pose(const struct nav_particles *p, long i)
{
    return (struct nav_pose){(double)p->x[i], (double)p->y[i], (double)atan2f(p->s[i], p->c[i])};
}

/* Three in four particles hold the odometry unbiased. */
static float particles_gain(const struct nav_particles *p, struct nav_rng *rng)
{
    return nav_rng_bits(rng) >> 62 ? 0.0f : p->spread * (float)nav_rng_rough(rng);
}

/* Half of the particles hold with the model's noise or half of it, as the model's allows for errors that persist; the
 * others with more. */
static float particles_noise(struct nav_rng *rng)
{
    static const float LEVELS[] = {1.0f, 0.5f, 2.0f, 5.0f};
    return LEVELS[nav_rng_bits(rng) >> 62];
}

void nav_particles_add(struct nav_particles *p, struct nav_pose pose, double weight, struct nav_rng *rng)
{
    if (p->count == p->room)
        return;
    long i = p->count++;
    nav_particles_set(p, i, pose);
    p->weight[i] = (float)weight;
    if (!p->gain)
        return;
    p->gain[i] = particles_gain(p, rng);
    p->turn_gain[i] = particles_gain(p, rng);
    p->noise[i] = particles_noise(rng);
    p->mode[i] = -1.0f;
}

/* Changes one guess of one particle now and then; those whose guesses fit outlive the others. */
static void particles_mutate(struct nav_particles *p, long i, struct nav_rng *rng)
{
    uint64_t bits = nav_rng_bits(rng);
    if ((double)(bits >> 11) * 0x1p-53 >= MUTATION)
        return;
    if ((bits & 7) > 5) {
        p->noise[i] = particles_noise(rng);
        return;
    }
    float *gain = bits & 1 ? &p->gain[i] : &p->turn_gain[i];
    if ((bits & 7) < 2)
        *gain = particles_gain(p, rng);
    else if (*gain != 0.0f)
        *gain += (float)NUDGE * p->spread * (float)nav_rng_rough(rng);
}

/* Turns unit vector (c, s) by an angle; a polynomial does for small ones, and the length is put right. */
static void particles_turn(float *c, float *s, float angle)
{
    float co, si, square = angle * angle;
    if (square < 0.1f) {
        co = 1.0f - square * (0.5f - square * (1.0f / 24.0f - square / 720.0f));
        si = angle * (1.0f - square * (1.0f / 6.0f - square / 120.0f));
    } else {
        co = cosf(angle);
        si = sinf(angle);
    }
    float a = *c * co - *s * si, b = *s * co + *c * si, mend = 1.5f - 0.5f * (a * a + b * b);
    *c = a * mend;
    *s = b * mend;
}

void nav_particles_move(struct nav_particles *p, struct nav_pose step, const struct nav_noise *noise, bool known,
                        struct nav_rng *rng)
{
    float sigma = (float)sqrt(noise->position), sigma_turn = (float)fmin(sqrt(noise->heading), NAV_PI);
    for (long i = 0; i < p->count; i++) {
        float c = p->c[i], s = p->s[i], dx = (float)step.x, dy = (float)step.y, turn = (float)step.theta, level = 1.0f;
        if (p->gain) {
            particles_mutate(p, i, rng);
            dx *= 1.0f + p->gain[i];
            dy *= 1.0f + p->gain[i];
            turn *= 1.0f + p->turn_gain[i];
            level = known ? p->noise[i] : fmaxf(p->noise[i], 1.0f);
        }
        p->x[i] += c * dx - s * dy + level * sigma * (float)nav_rng_rough(rng);
        p->y[i] += s * dx + c * dy + level * sigma * (float)nav_rng_rough(rng);
        particles_turn(&p->c[i], &p->s[i], turn + level * sigma_turn * (float)nav_rng_rough(rng));
    }
}

void nav_particles_scale(struct nav_particles *p, double factor)
{
    for (long i = 0; i < p->count; i++)
        p->weight[i] *= (float)factor;
}

double nav_particles_weigh(struct nav_particles *p, struct nav_likelihood *l, double mass)
{
    float best = 2.0f * BLOCKED;
    double total = 0.0, passed = 0.0, mark = 0.5 / MAP_POSES;
    if (mass >= 0.0) {
        nav_trust_begin(l);
        nav_map_begin(l);
    }
    for (long i = 0; i < p->count; i++) {
        const struct nav_place at = {(double)p->x[i], (double)p->y[i], (double)p->c[i], (double)p->s[i]};
        bool clear = nav_likelihood_clear(l, at.x, at.y, 0.0);
        p->loglik[i] = clear ? fmaxf(nav_likelihood_at(l, &at, l->scratch), BLOCKED / 2.0f) : BLOCKED;
        if (clear && mass >= 0.0)
            nav_trust_add(l, l->scratch, mass * (double)p->weight[i]);
        for (passed += (double)p->weight[i]; clear && mass >= 0.0 && passed > mark; mark += 1.0 / MAP_POSES)
            nav_map_add(l, &at, l->scratch, 1.0 / MAP_POSES);
        if (p->weight[i] > 0.0f && p->loglik[i] > best)
            best = p->loglik[i];
    }
    for (long i = 0; i < p->count; i++) {
        p->weight[i] *= expf(fminf(p->loglik[i] - best, 0.0f));
        total += (double)p->weight[i];
    }
    nav_particles_scale(p, 1.0 / total);
    return log(total) + (double)best;
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

void nav_particles_resample(struct nav_particles *p, long count, double offset)
{
    double total = 0.0, passed = 0.0;
    for (long i = 0; i < p->count; i++)
        total += (double)p->weight[i];
    float *drawn = p->spare;
    long i = 0;
    for (long k = 0; k < count; k++) {
        double mark = ((double)k + offset) / (double)count * total;
        while (i + 1 < p->count && passed + (double)p->weight[i] <= mark)
            passed += (double)p->weight[i++];
        for (int column = 0; column < p->columns; column++)
            drawn[column * p->room + k] = p->memory[column * p->room + i];
    }
    p->spare = p->memory;
    p->memory = drawn;
    p->count = count;
    particles_point(p);
    for (long k = 0; k < count; k++)
        p->weight[k] = 1.0f / (float)count;
}
