/* What texture whiskers read where, along the path of one particle. */
#ifndef NAV_TRAIL_H
#define NAV_TRAIL_H

#include "borders.h"

enum { NAV_TRAIL_MOST = 4000, NAV_TRAIL_BORDERS = 400, NAV_TRAIL_RATES = 4 };

struct nav_trail_point {
    double x, y; /* m */
};

struct nav_trail {
    int tips, classes, count, borders;
    struct nav_trail_point *point;                    /* [MOST] of windows */
    float *weight;                                    /* [MOST][classes] their log-likelihoods */
    float *fresh;                                     /* [MOST] the same by patches, given the windows before */
    unsigned char *tip;                               /* [MOST] */
    struct nav_trail_point border[NAV_TRAIL_BORDERS]; /* where textures change */
    double *patch; /* [RATES][tips][classes] belief of the texture under each tip, by patches of each size */
    double evidence[NAV_TRAIL_RATES]; /* log-likelihood of the windows of the trail */
    double all[NAV_TRAIL_RATES];      /* the same of all windows ever */
    struct nav_borders finder;
};

/* 0, or -1 without memory; nav_trail_free either way. */
int nav_trail_init(struct nav_trail *, const struct nav_arena *, const struct nav_robot *);
void nav_trail_free(struct nav_trail *);
void nav_trail_clear(struct nav_trail *);

/* Becomes equal, of the same robot. */
void nav_trail_copy(struct nav_trail *to, const struct nav_trail *from);

/* The robot's motion as its wheels report it, before a row's windows. */
void nav_trail_move(struct nav_trail *, struct nav_pose step);

/* A window of a tip of a robot at this pose, `moved` m after its last one; ratio[k]: p(window | texture k) / p(any). */
void nav_trail_add(struct nav_trail *, const struct nav_pose *, int tip, double moved, const float *ratio);

/* Log-likelihood of the trail's windows, or of all ever, textures lying in patches of any shape, large or small. */
double nav_trail_patches(const struct nav_trail *, bool all);

/* After the last window of a row that has any. */
void nav_trail_row_done(struct nav_trail *);

#endif
