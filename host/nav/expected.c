#include "expected.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double POSES_MOST = 268435456.0;

static size_t pitch(const struct nav_expected *e)
{
    return (size_t)(e->nx + 2 * e->margin);
}

static size_t poses(const struct nav_expected *e)
{
    return (size_t)e->nh * (size_t)(e->ny + 2 * e->margin) * pitch(e);
}

/* Signatures while they are being collected: open addressing over numbers into a growing list of codes. */
struct book {
    uint32_t *slot; /* 0: empty */
    size_t slots;   /* power of two */
    uint8_t *codes;
    uint32_t count, room;
    size_t width;
};

static uint64_t hash(const uint8_t *codes, size_t width)
{
    uint64_t h = 14695981039346656037u; /* FNV-1a */
    for (size_t i = 0; i < width; i++)
        h = (h ^ codes[i]) * 1099511628211u;
    return h ^ (h >> 29);
}

static size_t place(const struct book *b, const uint8_t *codes)
{
    size_t i = (size_t)hash(codes, b->width) & (b->slots - 1);
    while (b->slot[i] && memcmp(b->codes + b->slot[i] * b->width, codes, b->width) != 0)
        i = (i + 1) & (b->slots - 1);
    return i;
}

static int grow(struct book *b)
{
    uint32_t room = b->room ? 2 * b->room : 1024;
    uint8_t *codes = realloc(b->codes, (size_t)room * b->width + 1);
    uint32_t *slot = calloc((size_t)room * 2, sizeof *slot);
    if (codes)
        b->codes = codes;
    if (!codes || !slot) {
        free(slot);
        return -1;
    }
    free(b->slot);
    b->slot = slot;
    b->slots = (size_t)room * 2;
    b->room = room;
    for (uint32_t n = 1; n < b->count; n++)
        b->slot[place(b, b->codes + n * b->width)] = n;
    return 0;
}

/* Number of a signature, new or known; 0: no memory. */
static uint32_t number_of(struct book *b, const uint8_t *codes)
{
    if (b->count == b->room && grow(b))
        return 0;
    size_t i = place(b, codes);
    if (!b->slot[i]) {
        memcpy(b->codes + b->count * b->width, codes, b->width);
        b->slot[i] = b->count++;
    }
    return b->slot[i];
}

struct maker {
    struct nav_expected *e;
    const struct nav_arena *arena;
    const struct nav_robot *robot;
    const struct nav_likelihood *likelihood;
    struct book book;
    uint8_t *codes; /* [whiskers] scratch */
};

/* All headings of one place: whether it is free does not depend on the heading. */
static int survey(struct maker *m, int i, int j)
{
    struct nav_expected *e = m->e;
    double x = (i + 0.5) * e->step, y = (j + 0.5) * e->step;
    /* Half a step of grace: the robot may well stand against a wall, between two lattice poses. */
    if (!nav_arena_free(m->arena, x, y, fmax(m->robot->body_radius - e->step / 2.0, 0.0)))
        return 0;
    size_t at = (size_t)(j + e->margin) * pitch(e) + (size_t)(i + e->margin);
    for (int k = 0; k < e->nh; k++, at += pitch(e) * (size_t)(e->ny + 2 * e->margin)) {
        nav_likelihood_expect(m->likelihood, m->arena, m->robot, (struct nav_pose){x, y, (k + 0.5) * e->step_theta},
                              m->codes);
        e->signature[at] = number_of(&m->book, m->codes);
        if (!e->signature[at])
            return -1;
    }
    return 0;
}

static int survey_all(struct maker *m)
{
    struct nav_expected *e = m->e;
    e->signature = calloc(poses(e), sizeof *e->signature);
    m->codes = calloc(m->book.width, 1);
    m->book.count = 1; /* number 0 is "blocked" */
    if (!e->signature || !m->codes || grow(&m->book))
        return -1;
    for (int j = 0; j < e->ny; j++) {
        for (int i = 0; i < e->nx; i++) {
            if (survey(m, i, j))
                return -1;
        }
    }
    return 0;
}

struct nav_expected *nav_expected_new(const struct nav_arena *arena, const struct nav_robot *robot,
                                      const struct nav_likelihood *likelihood, double step, int headings, int margin)
{
    double nx = ceil(arena->size_x / step - 1e-6), ny = ceil(arena->size_y / step - 1e-6);
    if (!((nx + 2 * margin) * (ny + 2 * margin) * headings <= POSES_MOST))
        return NULL;
    struct nav_expected *e = calloc(1, sizeof *e);
    if (!e)
        return NULL;
    *e = (struct nav_expected){.nx = (int)nx,
                               .ny = (int)ny,
                               .nh = headings,
                               .margin = margin,
                               .step = step,
                               .step_theta = 2.0 * NAV_PI / headings,
                               .whiskers = likelihood->whiskers};
    struct maker m = {.e = e, .arena = arena, .robot = robot, .likelihood = likelihood};
    m.book.width = (size_t)likelihood->whiskers + 1; /* one more, always 0: a robot without whiskers has codes too */
    int failed = survey_all(&m);
    free(m.codes);
    free(m.book.slot);
    e->codes = m.book.codes;
    e->signatures = m.book.count;
    e->value = calloc(e->signatures, sizeof *e->value);
    if (failed || !e->value) {
        nav_expected_free(e);
        return NULL;
    }
    return e;
}

void nav_expected_free(struct nav_expected *e)
{
    if (!e)
        return;
    free(e->signature);
    free(e->codes);
    free(e->value);
    free(e);
}

void nav_expected_evaluate(struct nav_expected *e, const struct nav_likelihood *likelihood)
{
    float best = -INFINITY;
    size_t width = (size_t)e->whiskers + 1;
    for (uint32_t n = 1; n < e->signatures; n++) {
        e->value[n] = nav_likelihood_of(likelihood, e->codes + n * width);
        best = fmaxf(best, e->value[n]);
    }
    for (uint32_t n = 1; n < e->signatures; n++)
        e->value[n] = expf(e->value[n] - best);
}

const uint32_t *nav_expected_row(const struct nav_expected *e, int k, int j)
{
    size_t row = (size_t)k * (size_t)(e->ny + 2 * e->margin) + (size_t)(j + e->margin);
    return e->signature + row * pitch(e) + (size_t)e->margin;
}

size_t nav_expected_bytes(const struct nav_expected *e)
{
    return poses(e) * sizeof *e->signature + e->signatures * ((size_t)e->whiskers + 1 + sizeof *e->value);
}
