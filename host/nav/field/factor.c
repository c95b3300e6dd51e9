#include "factor.h"

#include <stdlib.h>
#include <string.h>

#include "book.h"

struct maker {
    struct nav_factor *f;
    const uint8_t *signatures;
    uint32_t count;
    int whiskers;
    const int *codes;
};

static int factor_make_leaf(struct maker *m, int whisker, uint32_t *number)
{
    struct nav_factor *f = m->f;
    struct nav_factor_node *node = &f->node[f->nodes];
    *node = (struct nav_factor_node){-1, -1, whisker, (uint32_t)m->codes[whisker], NULL, NULL};
    node->value = calloc(node->count, sizeof *node->value);
    for (uint32_t n = 0; n < m->count; n++)
        number[n] = m->signatures[(size_t)n * (size_t)m->whiskers + (size_t)whisker];
    return node->value ? f->nodes++ : -1;
}

/* Numbers the pairs of two children's stretches; `number` holds the left ones and takes the result. */
static int factor_join(struct maker *m, int left, int right, uint32_t *number, const uint32_t *other)
{
    struct nav_factor *f = m->f;
    struct nav_book book = {.width = sizeof(struct nav_pair)};
    for (uint32_t n = 0; n < m->count; n++) {
        struct nav_pair pair = {number[n], other[n]};
        number[n] = nav_book_number(&book, &pair);
        if (number[n] == NAV_BOOK_FULL) {
            nav_book_free(&book);
            return -1;
        }
    }
    struct nav_factor_node *node = &f->node[f->nodes];
    *node = (struct nav_factor_node){left, right, -1, book.count, (struct nav_pair *)(void *)book.keys, NULL};
    node->value = calloc((size_t)book.count + 1, sizeof *node->value);
    book.keys = NULL;
    nav_book_free(&book);
    return f->nodes++;
}

/* Node over whiskers begin .. end - 1: its number, or -1. `number`: of each signature's stretch there. */
static int factor_make(struct maker *m, int begin, int end, uint32_t *number)
{
    if (end - begin == 1)
        return factor_make_leaf(m, begin, number);
    int middle = (begin + end) / 2, node = -1;
    uint32_t *other = calloc((size_t)m->count + 1, sizeof *other);
    int left = other ? factor_make(m, begin, middle, number) : -1;
    int right = left >= 0 ? factor_make(m, middle, end, other) : -1;
    if (right >= 0)
        node = factor_join(m, left, right, number, other);
    free(other);
    return node >= 0 && m->f->node[node].value ? node : -1;
}

int nav_factor_init(struct nav_factor *f, const uint8_t *signatures, uint32_t count, int whiskers, const int *codes)
{
    struct maker m = {f, signatures, count, whiskers, codes};
    uint32_t *number = calloc((size_t)count + 1, sizeof *number);
    *f = (struct nav_factor){.node = calloc((size_t)whiskers * 2, sizeof *f->node)};
    int made = number && f->node ? factor_make(&m, 0, whiskers, number) : -1;
    free(number);
    return made >= 0 ? 0 : -1;
}

void nav_factor_free(struct nav_factor *f)
{
    for (int n = 0; f->node && n < f->nodes; n++) {
        free(f->node[n].pair);
        free(f->node[n].value);
    }
    free(f->node);
}

static void factor_work_out_node(struct nav_factor *f, int n)
{
    struct nav_factor_node *node = &f->node[n];
    if (node->left < 0)
        return;
    const double *left = f->node[node->left].value, *right = f->node[node->right].value;
    for (uint32_t i = 0; i < node->count; i++)
        node->value[i] = left[node->pair[i].left] * right[node->pair[i].right];
}

void nav_factor_prepare(struct nav_factor *f)
{
    for (int n = 0; n + 1 < f->nodes; n++)
        factor_work_out_node(f, n);
}

size_t nav_factor_bytes(const struct nav_factor *f)
{
    size_t bytes = (size_t)f->nodes * sizeof *f->node;
    for (int n = 0; n < f->nodes; n++)
        bytes += f->node[n].count * (sizeof *f->node[n].value + (f->node[n].pair ? sizeof *f->node[n].pair : 0));
    return bytes;
}
