/* What a mapper holds. */
#ifndef NAV_MAPPER_STATE_H
#define NAV_MAPPER_STATE_H

#include "kidnap.h"
#include "mapper.h"

struct nav_mapper {
    const struct nav_problem *problem;
    struct nav_mapper_options options;
    struct nav_record record;
    struct nav_particle_map hypothesis[NAV_HYPOTHESES];
    struct nav_course course;   /* of the likeliest */
    struct nav_kept challenger; /* takes all rows of this map again, with a lattice */
    bool challenged;            /* whether there is one */
    struct nav_lattice_search search;
    int sought; /* borders when a lattice was sought last */
    struct nav_kidnap kidnap;
    struct nav_mapper_lost lost;
    bool begun; /* a row has come that does not say that the robot was carried */
};

/* The likeliest hypothesis. */
const struct nav_particle_map *nav_mapper_best(const struct nav_mapper *);

#endif
