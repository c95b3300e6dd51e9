/* Products over whiskers for many signatures at once.
 *
 * A signature is a row of codes. Halves of signatures recur far more often than whole ones, so the product is worked
 * out over a binary tree: each node knows the distinct stretches of codes below it as pairs of its children's. Every
 * distinct stretch costs one multiplication per row. */
#ifndef NAV_FACTOR_H
#define NAV_FACTOR_H

#include <stddef.h>
#include <stdint.h>

struct nav_pair {
    uint32_t left, right; /* numbers of the children's stretches; a leaf's are codes */
};

struct nav_factor_node {
    int left, right; /* nodes; -1: a leaf, for whisker `whisker` */
    int whisker;
    uint32_t count;        /* distinct stretches */
    struct nav_pair *pair; /* [count] of an inner node */
    double *value;         /* [count] of the present row */
};

struct nav_factor {
    int nodes; /* the last is the root */
    struct nav_factor_node *node;
};

/* From signatures[count][whiskers]; a whisker has codes[w] of them. Root stretch n is signature n, which must be
 * distinct. 0, or -1 without memory. At least two whiskers. */
int nav_factor_init(struct nav_factor *, const uint8_t *signatures, uint32_t count, int whiskers, const int *codes);
void nav_factor_free(struct nav_factor *);

/* From the leaves' values, which are filled first: all but the last product of each signature, and that product for
 * one.
 */
void nav_factor_prepare(struct nav_factor *);
static inline double nav_factor_one(const struct nav_factor *f, uint32_t signature)
{
    const struct nav_factor_node *root = &f->node[f->nodes - 1];
    struct nav_pair pair = root->pair[signature];
    return f->node[root->left].value[pair.left] * f->node[root->right].value[pair.right];
}

size_t nav_factor_bytes(const struct nav_factor *);

#endif
