#include "particle_bins.h"

#include <math.h>
#include <stdlib.h>

struct nav_bin {
    int32_t x, y, turn;
    bool used;
    double weight;
};

int nav_bins_init(struct nav_bins *b, long particles, double edge, double extent)
{
    *b = (struct nav_bins){.edge = edge, .turns = (int)fmax(round(2.0 * NAV_PI / extent), 1.0), .slots = 4};
    while (b->slots < 2 * particles)
        b->slots *= 2;
    b->bin = calloc((size_t)b->slots, sizeof *b->bin);
    b->filled = calloc((size_t)particles + 1, sizeof *b->filled);
    return b->bin && b->filled ? 0 : -1;
}

void nav_bins_free(struct nav_bins *b)
{
    free(b->bin);
    free(b->filled);
}

static int32_t bins_index_of(double position, double edge)
{
    return (int32_t)fmax(fmin(floor(position / edge), 1e9), -1e9);
}

static struct nav_bin *bins_place(struct nav_bins *b, int32_t x, int32_t y, int32_t turn)
{
    uint64_t h = (uint64_t)(uint32_t)x * 0x9e3779b97f4a7c15u ^ (uint64_t)(uint32_t)y * 0xc2b2ae3d27d4eb4fu ^
                 (uint64_t)(uint32_t)turn * 0x165667b19e3779f9u;
    long i = (long)((h ^ h >> 29) & (uint64_t)(b->slots - 1));
    for (; b->bin[i].used; i = (i + 1) & (b->slots - 1)) {
        if (b->bin[i].x == x && b->bin[i].y == y && b->bin[i].turn == turn)
            return &b->bin[i];
    }
    b->bin[i] = (struct nav_bin){x, y, turn, true, 0.0};
    b->filled[b->count++] = i;
    return &b->bin[i];
}

void nav_bins_fill(struct nav_bins *b, const struct nav_particles *p)
{
    for (long n = 0; n < b->count; n++)
        b->bin[b->filled[n]].used = false;
    b->count = 0;
    for (long i = 0; i < p->count; i++) {
        if (!(p->weight[i] > 0.0f))
            continue;
        double turn = (double)atan2f(p->s[i], p->c[i]) / (2.0 * NAV_PI) + 0.5;
        struct nav_bin *bin =
            bins_place(b, bins_index_of((double)p->x[i], b->edge), bins_index_of((double)p->y[i], b->edge),
                       (int32_t)(turn * b->turns) % b->turns);
        bin->weight += (double)p->weight[i];
    }
}

struct nav_pose nav_bins_mode(const struct nav_bins *b)
{
    const struct nav_bin *best = &b->bin[b->filled[0]];
    for (long n = 1; n < b->count; n++) {
        if (b->bin[b->filled[n]].weight > best->weight)
            best = &b->bin[b->filled[n]];
    }
    return (struct nav_pose){(best->x + 0.5) * b->edge, (best->y + 0.5) * b->edge,
                             ((best->turn + 0.5) / b->turns - 0.5) * 2.0 * NAV_PI};
}

double nav_bins_bound(double bins, double error)
{
    static const double Z = 2.3263478740; /* 99 % point of the standard normal */
    if (bins <= 1.0)
        return 1.0;
    double a = 2.0 / (9.0 * (bins - 1.0)), root = 1.0 - a + sqrt(a) * Z;
    return (bins - 1.0) / (2.0 * error) * root * root * root;
}

/* Bins that `count` draws occupy: a bin with less than a draw's worth of weight counts as its chance of one. */
static double bins_occupied(const struct nav_bins *b, double count, double anywhere)
{
    double sum = count * anywhere;
    for (long n = 0; n < b->count; n++)
        sum += fmin(1.0, count * (1.0 - anywhere) * b->bin[b->filled[n]].weight);
    return sum;
}

long nav_bins_needed(const struct nav_bins *b, const struct nav_sample *sample, double anywhere)
{
    enum { ROUNDS = 6 };
    double count = (double)sample->most;
    if (sample->least >= sample->most)
        return sample->most;
    for (int n = 0; n < ROUNDS; n++)
        count = fmin(nav_bins_bound(bins_occupied(b, count, anywhere), sample->error), (double)sample->most);
    return (long)fmax(ceil(count), (double)sample->least);
}

struct nav_mode nav_particles_summary(const struct nav_particles *p, struct nav_bins *b, struct nav_pose guess)
{
    struct nav_pose mean;
    double mass = nav_particles_near(p, guess, &mean);
    mass = nav_particles_near(p, mean, &mean);
    if (mass < 0.5) {
        nav_bins_fill(b, p);
        nav_particles_near(p, nav_bins_mode(b), &mean);
        mass = nav_particles_near(p, mean, &mean);
    }
    return (struct nav_mode){mean, fmin(mass, 1.0)};
}

bool nav_particles_begin(struct nav_particles *p, struct nav_bins *b, const struct nav_likelihood *l,
                         const struct nav_prior *prior, double anywhere, struct nav_rng *rng,
                         const struct nav_sample *sample)
{
    bool free = false;
    p->count = 0;
    while (p->count < sample->most) {
        struct nav_pose pose;
        free = nav_particles_draw(l, prior, anywhere, rng, &pose) || free;
        nav_particles_add(p, pose, 1.0 / (double)sample->most, rng);
    }
    nav_bins_fill(b, p);
    p->count = nav_bins_needed(b, sample, 0.0); /* drawn independently, the first few do as well as any */
    nav_particles_scale(p, (double)sample->most / (double)p->count);
    return free;
}

size_t nav_bins_bytes(const struct nav_bins *b)
{
    return (size_t)b->slots * (sizeof *b->bin + sizeof *b->filled / 2);
}
