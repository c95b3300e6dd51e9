#include "expected.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "book.h"

static const double POSES_MOST = 268435456.0;

/* Cells around the arena: a shift by one, and what may be read together with the arena's last cell. */
enum { MARGIN = NAV_CELLS_AHEAD + 2 };

/* Rows of poses in a cell: as the settings' ranges allow. */
enum { ROWS_MOST = NAV_SUB_MOST * NAV_SUB_MOST };

static size_t expected_pitch(const struct nav_expected *e)
{
    return (size_t)(e->nx + 2 * e->margin);
}

static size_t expected_poses(const struct nav_expected *e)
{
    return (size_t)e->nh * (size_t)(e->ny + 2 * e->margin) * expected_pitch(e);
}

struct maker {
    struct nav_expected *e;
    const struct nav_likelihood *likelihood;
    struct nav_book book;
    uint8_t
        *codes; /* scratch: 1 for a free pose, then [whiskers], then 1 for ground that is not mapped, where any is */
};

/* All headings of one place: whether it is free does not depend on the heading. */
static int expected_survey(struct maker *m, int i, int j)
{
    struct nav_expected *e = m->e;
    double x = (i + 0.5) * e->step, y = (j + 0.5) * e->step;
    /* Half a step of grace: the robot may well stand against a wall, between two lattice poses. */
    if (!nav_likelihood_clear(m->likelihood, x, y, e->step / 2.0))
        return 0;
    double prior = nav_likelihood_prior(m->likelihood, x, y);
    if (m->likelihood->arena->unknown > 0)
        m->codes[1 + e->whiskers] = prior < 1.0;
    size_t at = (size_t)(j + e->margin) * expected_pitch(e) + (size_t)(i + e->margin);
    for (int k = 0; k < e->nh; k++, at += expected_pitch(e) * (size_t)(e->ny + 2 * e->margin)) {
        double theta = (k + 0.5) * e->step_theta;
        nav_likelihood_expect(m->likelihood, &(struct nav_place){x, y, cos(theta), sin(theta)}, m->codes + 1);
        e->signature[at] = nav_book_number(&m->book, m->codes);
        e->standing += prior / ((double)e->nh * e->ny * e->nx);
        if (e->signature[at] == NAV_BOOK_FULL)
            return -1;
    }
    return 0;
}

static int expected_survey_all(struct maker *m)
{
    struct nav_expected *e = m->e;
    e->signature = calloc(expected_poses(e), sizeof *e->signature);
    m->codes = calloc(m->book.width, 1);
    if (!e->signature || !m->codes || nav_book_number(&m->book, m->codes) != 0)
        return -1; /* number 0 is "blocked" */
    m->codes[0] = 1;
    for (int j = 0; j < e->ny; j++) {
        for (int i = 0; i < e->nx; i++) {
            if (expected_survey(m, i, j))
                return -1;
        }
    }
    return 0;
}

/* At least two: the root of a tree of products must be a product, whose stretches are numbered as the signatures are.
 */
static size_t expected_code_width(const struct nav_likelihood *l)
{
    int factors = l->whiskers + (l->arena->unknown > 0);
    return factors > 2 ? (size_t)factors : 2;
}

/* Takes the signatures over from the book, whose keys begin with the byte for free or blocked. */
static int expected_keep_codes(struct nav_expected *e, const struct nav_book *book)
{
    size_t whiskers = (size_t)e->whiskers;
    e->signatures = book->count;
    e->codes = calloc(book->count, whiskers + 1);
    for (uint32_t n = 0; e->codes && n < book->count; n++)
        memcpy(e->codes + n * (whiskers + 1), (const uint8_t *)nav_book_key(book, n) + 1, whiskers);
    return e->codes ? 0 : -1;
}

/* The tree of products over the free poses' signatures. */
static int expected_make_factor(struct nav_expected *e, const struct nav_book *book,
                                const struct nav_likelihood *likelihood)
{
    size_t width = expected_code_width(likelihood), count = e->signatures - 1;
    uint8_t *packed = calloc(count + 1, width);
    int *codes = calloc(width, sizeof *codes), failed = -1;
    if (packed && codes) {
        for (uint32_t n = 0; n < count; n++)
            memcpy(packed + n * width, (const uint8_t *)nav_book_key(book, n + 1) + 1, width);
        for (size_t w = 0; w < width; w++)
            codes[w] = 1;
        for (int w = 0; w < e->whiskers; w++)
            codes[w] = likelihood->model[w].codes;
        if (likelihood->arena->unknown > 0)
            codes[e->whiskers] = 2;
        failed = nav_factor_init(&e->factor, packed, (uint32_t)count, (int)width, codes);
    }
    free(packed);
    free(codes);
    return failed;
}

/* Values of the present row, none worked out. */
static int expected_make_values(struct nav_expected *e)
{
    e->value = calloc(e->signatures, sizeof *e->value);
    e->known = calloc(e->signatures, sizeof *e->known);
    for (uint32_t n = 1; e->value && n < e->signatures; n++)
        e->value[n] = -1.0f;
    return e->value && e->known ? 0 : -1;
}

struct nav_expected *nav_expected_new(const struct nav_likelihood *likelihood, double cell, int headings, int sub,
                                      int turns)
{
    const struct nav_arena *arena = likelihood->arena;
    double step = cell / sub, nx = ceil(arena->size_x / step - 1e-6), ny = ceil(arena->size_y / step - 1e-6);
    int margin = MARGIN * sub;
    if (!((nx + 2 * margin) * (ny + 2 * margin) * headings * turns <= POSES_MOST))
        return NULL;
    struct nav_expected *e = calloc(1, sizeof *e);
    if (!e)
        return NULL;
    *e = (struct nav_expected){.nx = (int)nx,
                               .ny = (int)ny,
                               .nh = headings * turns,
                               .margin = margin,
                               .step = step,
                               .step_theta = 2.0 * NAV_PI / (headings * turns),
                               .sub = sub,
                               .turns = turns,
                               .unmapped = 1.0,
                               .whiskers = likelihood->whiskers};
    struct maker m = {.e = e, .likelihood = likelihood};
    m.book.width = expected_code_width(likelihood) + 1;
    int failed = expected_survey_all(&m) || expected_keep_codes(e, &m.book) ||
                 expected_make_factor(e, &m.book, likelihood) || expected_make_values(e);
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
    free(e->value);
    free(e->known);
    nav_factor_free(&e->factor);
    free(e);
}

/* A product of factors stays above 1e-304 when all their ranges together stay below this, nats. */
static const double RANGE_MOST = 700.0;

static void expected_evaluate_leaf(const struct nav_expected *e, const struct nav_factor_node *leaf, const float *table)
{
    float best = table[0];
    for (uint32_t k = 1; k < leaf->count; k++)
        best = fmaxf(best, table[k]);
    for (uint32_t k = 0; k < leaf->count; k++)
        leaf->value[k] = exp(fmax((double)(table[k] - best), -RANGE_MOST / e->whiskers));
}

static void expected_evaluate_leaves(struct nav_expected *e, const float *const *table)
{
    for (int n = 0; n < e->factor.nodes; n++) {
        const struct nav_factor_node *node = &e->factor.node[n];
        if (node->left >= 0)
            continue;
        if (node->whisker < e->whiskers)
            expected_evaluate_leaf(e, node, table[node->whisker]);
        else
            for (uint32_t k = 0; k < node->count; k++)
                node->value[k] = k == 0 ? 1.0 : e->unmapped;
    }
}

void nav_expected_begin(struct nav_expected *e, const float *const *table, float blocked)
{
    for (uint32_t n = 0; n < e->knowns; n++)
        e->value[e->known[n]] = -1.0f;
    e->knowns = 0;
    e->value[0] = blocked;
    expected_evaluate_leaves(e, table);
    nav_factor_prepare(&e->factor);
}

struct nav_layer nav_expected_layer(const struct nav_expected *e, double heading, double shift_x, double shift_y)
{
    double turns = (heading / e->step_theta - (e->turns - 1) / 2.0) / e->nh;
    return (struct nav_layer){.heading = (int)((turns - floor(turns)) * e->nh) % e->nh,
                              .x = (int)floor(shift_x / e->step + 0.5),
                              .y = (int)floor(shift_y / e->step + 0.5)};
}

/* First of the poses of a layer's row of cells that share a heading and a y, from column 0 on. */
static const uint32_t *expected_row(const struct nav_expected *e, const struct nav_layer *layer, int row, int turn,
                                    int b)
{
    size_t k = (size_t)((layer->heading + turn) % e->nh);
    size_t line = k * (size_t)(e->ny + 2 * e->margin) + (size_t)(row * e->sub + layer->y + b + e->margin);
    return e->signature + line * expected_pitch(e) + (ptrdiff_t)(e->margin + layer->x);
}

void nav_expected_scale(struct nav_expected *e)
{
    double best = 0.0;
    for (uint32_t n = 1; n < e->signatures; n++)
        best = fmax(best, nav_factor_one(&e->factor, n - 1));
    for (uint32_t n = 1; n < e->signatures; n++) {
        e->known[n - 1] = n;
        e->value[n] = (float)(nav_factor_one(&e->factor, n - 1) / fmax(best, 1e-300));
    }
    e->knowns = e->signatures - 1;
}

static float expected_value(struct nav_expected *e, uint32_t n)
{
    if (e->value[n] < 0.0f) {
        e->known[e->knowns++] = n;
        e->value[n] = (float)nav_factor_one(&e->factor, n - 1);
    }
    return e->value[n];
}

/* Sum of the values of a cell's poses, which lie in several rows of the lattice. Which cells hold mass, and which
 * values are known, nobody can predict: what is not known yet is negative, and is asked for only then. */
static inline float expected_sum(struct nav_expected *e, const uint32_t *const *row, int rows, int sub, int at,
                                 float mass)
{
    const float *value = e->value;
    float sum = 0.0f, least = 0.0f;
    for (int r = 0; r < rows; r++) {
        for (int a = 0; a < sub; a++) {
            float known = value[row[r][at + a]];
            sum += known;
            least = known < least ? known : least;
        }
    }
    if (least >= 0.0f || !(mass > 0.0f))
        return sum;
    sum = 0.0f;
    for (int n = 0; n < rows * sub; n++)
        sum += expected_value(e, row[n / sub][at + n % sub]);
    return sum;
}

void nav_expected_mean(struct nav_expected *e, const struct nav_layer *layer, int row, int first, const float *mass,
                       float *like)
{
    int sub = e->sub, rows = sub * e->turns;
    const uint32_t *line[ROWS_MOST];
    float share = 1.0f / (float)(sub * rows);
    for (int r = 0; r < rows; r++)
        line[r] = expected_row(e, layer, row, r / sub, r % sub) + (ptrdiff_t)first * sub;
    for (int n = 0; n < NAV_CELLS_AHEAD; n++) {
        if (sub == 2 && rows == 2)
            like[n] = share * expected_sum(e, line, 2, 2, 2 * n, mass[n]);
        else if (sub == 2 && rows == 4)
            like[n] = share * expected_sum(e, line, 4, 2, 2 * n, mass[n]);
        else
            like[n] = share * expected_sum(e, line, rows, sub, sub * n, mass[n]);
    }
}

const uint8_t *nav_expected_codes(const struct nav_expected *e, const struct nav_layer *layer, int row, int column,
                                  int n)
{
    const uint32_t *poses = expected_row(e, layer, row, n / e->sub / e->sub, n / e->sub % e->sub);
    uint32_t signature = poses[column * e->sub + n % e->sub];
    return signature ? e->codes + signature * ((size_t)e->whiskers + 1) : NULL;
}

size_t nav_expected_bytes(const struct nav_expected *e)
{
    return expected_poses(e) * sizeof *e->signature +
           e->signatures * ((size_t)e->whiskers + 1 + sizeof *e->value + sizeof *e->known) +
           nav_factor_bytes(&e->factor);
}
