/* Textures of the floor as a particle believes them: patches of any shape, or a square lattice of tiles whose pitch,
 * phase and turn are numbers of the joint. */
#ifndef NAV_FLOOR_H
#define NAV_FLOOR_H

#include <stdbool.h>

#include "joint.h"
#include "lattice.h"

enum { NAV_FLOOR_SIDE = 48 }; /* tiles each way, its middle at the lattice's reference */

struct nav_floor {
    bool known; /* the lattice */
    int classes;
    double x, y;      /* reference of the lattice */
    double evidence;  /* log-likelihood of all windows by tiles */
    double agreement; /* of late windows, a running mean of the same, nats */
    float *tile;      /* [SIDE][SIDE][classes] log-likelihoods of each tile's texture */
};

/* 0, or -1 without memory; nav_floor_free either way. */
int nav_floor_init(struct nav_floor *, int classes);
void nav_floor_free(struct nav_floor *);
void nav_floor_copy(struct nav_floor *to, const struct nav_floor *from);

/* Takes a window of the tip at (x, y) of the robot: ratio[k] = p(window | texture k) / p(window | any). Corrects the
 * joint at borders. Returns the window's log-likelihood, 0 without a lattice. */
double nav_floor_take(struct nav_floor *, struct nav_joint *, double x, double y, const float *ratio);

/* The tile under the tip at (x, y) of the robot. */
void nav_floor_at(const struct nav_floor *, const struct nav_joint *, double x, double y, int *column, int *row);

/* Takes over a lattice, whose tiles are not known. right: it stands along the world's right angles. */
void nav_floor_adopt(struct nav_floor *, struct nav_joint *, const struct nav_lattice *, bool right);

/* Probability of the likeliest texture of a tile, and which; 0 beyond the lattice and where nothing was read. */
double nav_floor_sure(const struct nav_floor *, int column, int row, int *texture);

#endif
