/* What a mapper holds. */
#ifndef NAV_MAPPER_STATE_H
#define NAV_MAPPER_STATE_H

#include "cells.h"
#include "mapper.h"
#include "particle_map.h"

#define NAV_MAPPER_AXES_KNOWN 1.0 /* rad^2 */

struct nav_mapper {
    const struct nav_problem *problem;
    struct nav_mapper_options options;
    struct nav_record record;
    struct nav_particle_map *particle;  /* [particles] */
    struct nav_particle_map challenger; /* takes all rows again, with a lattice */
    long caught_up;                     /* rows it has taken; -1: there is none */
    struct nav_trail trail, challenger_trail;
    struct nav_cells cells;
    struct nav_lattice_search search;
    int sought; /* borders when a lattice was sought last */
    struct nav_rng rng;
};

/* The likeliest hypothesis. */
struct nav_particle_map *nav_mapper_best(const struct nav_mapper *);

#endif
