#include "expected.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "book.h"

static const double POSES_MOST = 268435456.0;

static size_t pitch(const struct nav_expected *e)
{
    return (size_t)(e->nx + 2 * e->margin);
}

static size_t poses(const struct nav_expected *e)
{
    return (size_t)e->nh * (size_t)(e->ny + 2 * e->margin) * pitch(e);
}

struct maker {
    struct nav_expected *e;
    const struct nav_likelihood *likelihood;
    struct nav_book book;
    uint8_t *codes; /* scratch: 1 for a free pose, then [whiskers] */
};

/* All headings of one place: whether it is free does not depend on the heading. */
static int survey(struct maker *m, int i, int j)
{
    struct nav_expected *e = m->e;
    double x = (i + 0.5) * e->step, y = (j + 0.5) * e->step;
    /* Half a step of grace: the robot may well stand against a wall, between two lattice poses. */
    if (!nav_likelihood_clear(m->likelihood, x, y, e->step / 2.0))
        return 0;
    size_t at = (size_t)(j + e->margin) * pitch(e) + (size_t)(i + e->margin);
    for (int k = 0; k < e->nh; k++, at += pitch(e) * (size_t)(e->ny + 2 * e->margin)) {
        double theta = (k + 0.5) * e->step_theta;
        nav_likelihood_expect(m->likelihood, &(struct nav_place){x, y, cos(theta), sin(theta)}, m->codes + 1);
        e->signature[at] = nav_book_number(&m->book, m->codes);
        if (e->signature[at] == NAV_BOOK_FULL)
            return -1;
    }
    return 0;
}

static int survey_all(struct maker *m)
{
    struct nav_expected *e = m->e;
    e->signature = calloc(poses(e), sizeof *e->signature);
    m->codes = calloc(m->book.width, 1);
    if (!e->signature || !m->codes || nav_book_number(&m->book, m->codes) != 0)
        return -1; /* number 0 is "blocked" */
    m->codes[0] = 1;
    for (int j = 0; j < e->ny; j++) {
        for (int i = 0; i < e->nx; i++) {
            if (survey(m, i, j))
                return -1;
        }
    }
    return 0;
}

/* At least two: the root of a tree of products must be a product, whose stretches are numbered as the signatures are.
 */
static size_t code_width(int whiskers)
{
    return whiskers > 2 ? (size_t)whiskers : 2;
}

/* Takes the signatures over from the book, whose keys begin with the byte that tells free from blocked. */
static int keep_codes(struct nav_expected *e, const struct nav_book *book)
{
    size_t whiskers = (size_t)e->whiskers;
    e->signatures = book->count;
    e->codes = calloc(book->count, whiskers + 1);
    for (uint32_t n = 0; e->codes && n < book->count; n++)
        memcpy(e->codes + n * (whiskers + 1), (const uint8_t *)nav_book_key(book, n) + 1, whiskers);
    return e->codes ? 0 : -1;
}

/* The tree of products over the free poses' signatures. */
static int make_factor(struct nav_expected *e, const struct nav_book *book, const struct nav_likelihood *likelihood)
{
    size_t width = code_width(e->whiskers), count = e->signatures - 1;
    uint8_t *packed = calloc(count + 1, width);
    int *codes = calloc(width, sizeof *codes), failed = -1;
    if (packed && codes) {
        for (uint32_t n = 0; n < count; n++)
            memcpy(packed + n * width, (const uint8_t *)nav_book_key(book, n + 1) + 1, width);
        for (size_t w = 0; w < width; w++)
            codes[w] = 1;
        for (int w = 0; w < e->whiskers; w++)
            codes[w] = likelihood->model[w].codes;
        failed = nav_factor_init(&e->factor, packed, (uint32_t)count, (int)width, codes);
    }
    free(packed);
    free(codes);
    if (!failed)
        e->value = e->factor.node[e->factor.nodes - 1].value;
    return failed;
}

struct nav_expected *nav_expected_new(const struct nav_likelihood *likelihood, double step, int headings, int margin)
{
    const struct nav_arena *arena = likelihood->arena;
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
    struct maker m = {.e = e, .likelihood = likelihood};
    m.book.width = code_width(e->whiskers) + 1;
    int failed = survey_all(&m) || keep_codes(e, &m.book) || make_factor(e, &m.book, likelihood);
    free(m.codes);
    nav_book_free(&m.book);
    if (!failed)
        return e;
    nav_expected_free(e);
    return NULL;
}

void nav_expected_free(struct nav_expected *e)
{
    if (!e)
        return;
    free(e->signature);
    free(e->codes);
    nav_factor_free(&e->factor);
    free(e);
}

/* A product of factors stays above 1e-304 when all their ranges together stay below this, nats. */
static const double RANGE_MOST = 700.0;

static void evaluate_leaf(const struct nav_expected *e, const struct nav_factor_node *leaf, const float *table)
{
    float best = table[0];
    for (uint32_t k = 1; k < leaf->count; k++)
        best = fmaxf(best, table[k]);
    for (uint32_t k = 0; k < leaf->count; k++)
        leaf->value[k] = exp(fmax((double)(table[k] - best), -RANGE_MOST / e->whiskers));
}

static void evaluate_leaves(struct nav_expected *e, const float *const *table)
{
    for (int n = 0; n < e->factor.nodes; n++) {
        const struct nav_factor_node *node = &e->factor.node[n];
        if (node->left >= 0)
            continue;
        if (node->whisker < e->whiskers)
            evaluate_leaf(e, node, table[node->whisker]);
        else
            node->value[0] = 1.0;
    }
}

void nav_expected_evaluate(struct nav_expected *e, const struct nav_likelihood *likelihood)
{
    evaluate_leaves(e, (const float *const *)likelihood->table);
    nav_factor_work_out(&e->factor);
}

void nav_expected_prepare(struct nav_expected *e, const float *const *table)
{
    evaluate_leaves(e, table);
    nav_factor_prepare(&e->factor);
}

const uint32_t *nav_expected_row(const struct nav_expected *e, int k, int j)
{
    size_t row = (size_t)k * (size_t)(e->ny + 2 * e->margin) + (size_t)(j + e->margin);
    return e->signature + row * pitch(e) + (size_t)e->margin;
}

void nav_expected_forget_poses(struct nav_expected *e)
{
    free(e->signature);
    e->signature = NULL;
}

size_t nav_expected_bytes(const struct nav_expected *e)
{
    size_t lattice = e->signature ? poses(e) * sizeof *e->signature : 0;
    return lattice + e->signatures * ((size_t)e->whiskers + 1) + nav_factor_bytes(&e->factor);
}
