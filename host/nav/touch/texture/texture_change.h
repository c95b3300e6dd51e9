/* Finds where the surface under one whisker changed, from blocks a fraction of a window long.
 *
 * What speed, load and the whisker do to a block's features is the same before and after a border, so it drops out of
 * their difference: a change from class k to class j is weighed against no change by the generalised likelihood ratio
 * of that difference, under the covariance that features have within one drive. Every place of the change that leaves
 * CHANGE_AFTER_LEAST to CHANGE_AFTER_MOST blocks after it is tried.
 */
#ifndef NAV_TEXTURE_CHANGE_H
#define NAV_TEXTURE_CHANGE_H

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

/* cffi: begin */
struct nav_texture_change;

enum { NAV_TEXTURE_CHANGE_AFTER_LEAST = 2, NAV_TEXTURE_CHANGE_AFTER_MOST = 6, NAV_TEXTURE_CHANGE_BEFORE_MOST = 16 };

/* What separates the classes in a block. All arrays are copied. */
struct nav_texture_change_rule {
    const double *steady;        /* [F][K] inverse covariance within a drive times each class's middle */
    const double *apart;         /* [K][K] squared distance of the middles by that covariance */
    const double *weight, *bias; /* [F][K], [K] log-likelihoods of a block by the covariance within classes */
};

/* F: features of a block (texture_features.h, neither levels nor shorter), K: classes. All arrays are copied. */
struct nav_texture_change_numbers {
    int classes, channels, length;               /* samples of a block */
    double share;                                /* of its independent evidence that a block in a row holds, 0 to 1 */
    double limit;                                /* nats: a ratio above it is a change */
    const double *floor;                         /* [channels] counts squared */
    struct nav_texture_change_rule inside, edge; /* the latter where an edge lies between: of what no ringing fills */
};

/* NULL when a size is out of range, a number is not finite, or memory is short. */
struct nav_texture_change *nav_texture_change_new(const struct nav_texture_change_numbers *);
void nav_texture_change_free(struct nav_texture_change *);

/* Takes a block [length][channels], finite and within +-1e9. Returns the ratio, nats, of the likeliest change among the
 * blocks held, and in *after how many blocks lie behind it; -1e9 and 0 while there are too few. Above the limit it is a
 * change, and what lies before is forgotten. Allocates nothing. */
double nav_texture_change_weigh(struct nav_texture_change *, const double *block, int *after);

/* An edge lies between the last block and the next, which is left out: the surface is as likely to change there as not.
 * For CHANGE_AFTER_MOST blocks a change is looked for at the edge alone, of what the whisker's ringing does not fill.
 */
void nav_texture_change_edge(struct nav_texture_change *);

/* Forgets all blocks. */
void nav_texture_change_reset(struct nav_texture_change *);
/* cffi: end */

int nav_texture_change_length(const struct nav_texture_change *);
double nav_texture_change_limit(const struct nav_texture_change *);

#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif
