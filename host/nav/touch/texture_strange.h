/* Surfaces never trained, told by several windows together: the mean of their features spreads less than one window's,
 * so what lies between two trained surfaces leaves both. */
#ifndef NAV_TEXTURE_STRANGE_H
#define NAV_TEXTURE_STRANGE_H

/* cffi: begin */
struct nav_texture_strange;

enum { NAV_TEXTURE_STRANGE_STEPS_MAX = 8 };

/* Step i judges the mean of the last 2^(i+1) windows. F: features, K: classes. All arrays are copied. */
struct nav_texture_strange_numbers {
    int classes, features, steps;
    const double *turn;   /* [steps][F][F] of a window's features; their mean then spreads alike in all directions */
    const double *middle; /* [steps][K][F] of each class's mean, turned likewise */
    const double *limit;  /* [steps] squared distance per feature beyond which a surface was never trained */
};

/* NULL when a size is out of range, a number is not finite, or memory is short. */
struct nav_texture_strange *nav_texture_strange_new(const struct nav_texture_strange_numbers *);
void nav_texture_strange_free(struct nav_texture_strange *);

/* Takes a window's features[F]. Returns the squared distance of the mean of the last windows, as many as the largest
 * step that is full takes, from the nearest class, over its limit: above 1 is a surface never trained; 0 while even the
 * first step is not full. Allocates nothing. */
double nav_texture_strange_weigh(struct nav_texture_strange *, const double *features);

/* The next window is no continuation. */
void nav_texture_strange_reset(struct nav_texture_strange *);
/* cffi: end */

int nav_texture_strange_features(const struct nav_texture_strange *);

#endif
