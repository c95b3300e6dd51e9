/* A square lattice of tiles of unknown pitch, phase and turn, sought in a trail of texture windows. */
#ifndef NAV_LATTICE_H
#define NAV_LATTICE_H

#include <stdbool.h>

#include "trail.h"

/* Lines at u + k pitch from (x, y) along direction `turn`, and at v + k pitch across it. */
struct nav_lattice {
    double turn, pitch, u, v, x, y;
    double sigma_m, sigma_pitch, sigma_turn; /* of u and v; of the pitch; of the turn */
    double score;                            /* nats for it by borders, over borders anywhere */
    double evidence;                         /* nats for it by all windows, over patches of any shape */
};

/* Memory of a search. */
struct nav_lattice_search {
    float *sum; /* [tiles][classes] */
    bool *used;
};

/* 0, or -1 without memory; nav_lattice_search_free either way. */
int nav_lattice_search_init(struct nav_lattice_search *, int classes);
void nav_lattice_search_free(struct nav_lattice_search *);

/* The lattice that explains the trail best. False: there are too few borders, or the evidence is against any lattice.
 * axes: direction of the world's right angles, rad; 0 when it is not known. */
bool nav_lattice_find(struct nav_lattice_search *, const struct nav_trail *, double axes, struct nav_lattice *out);

#endif
