/* What a mapper holds. */
#ifndef NAV_MAPPER_STATE_H
#define NAV_MAPPER_STATE_H

#include "mapper.h"
#include "meeting.h"

#define NAV_MAPPER_AXES_KNOWN 1.0 /* rad^2 */
enum {
    NAV_MAPPER_HYPOTHESES = 12,
    NAV_MAPPER_KEPT = 3,
    NAV_MAPPER_AGAIN = 2000, /* rows taken again at once, at most */
    NAV_MAPPER_PARTS = 64,
    NAV_MAPPER_DOUBTS = 64
};

/* Log-likelihoods of a row: of its contacts, of its windows, and of these by patches of any shape. */
struct nav_gained {
    double contacts, windows, patches;
};

/* A tile, and by how many nats patches explain its windows better. */
struct nav_doubt {
    int column, row;
    double nats;
};

/* Whether the robot was carried off, and the maps from before. */
struct nav_kidnaps {
    struct nav_particle_map fresh; /* a map begun anew has taken the rows since `since` ... */
    long since;
    double felt;                               /* ... and explains their contacts by so many nats better, */
    struct nav_doubt doubt[NAV_MAPPER_DOUBTS]; /* and windows of these tiles, */
    int doubts;
    double ratio;  /* all in all: a tile that is otherwise than mapped costs its prior once */
    double enough; /* nats at which it is looked into next */
    struct nav_gained gained[NAV_MAPPER_AGAIN]; /* the last rows, by the map in use */
    struct nav_kept calm;                       /* the map in use, not long before then */
    struct nav_kept second; /* a map begun anew now and then, to be sought in the map of before it */
    struct nav_pose placed; /* where its origin is believed to be */
    double then;            /* evidence of the map in use when it began */
    bool suspected;         /* it began where the robot may have been carried off */
    struct nav_pose found;  /* where that begun at row `found_by` was found for sure the last time */
    long found_by;
    struct nav_kept before[2];             /* the map in use, when the second began, and when the one before it did */
    struct nav_kept kept[NAV_MAPPER_KEPT]; /* of parts that are not joined yet */
    int count;
    struct nav_pose met; /* where the map in use was found in the part `met_part` the last time */
    int met_part;
    struct nav_kept joined; /* being tried */
    struct nav_meeting meeting;
    struct nav_mapper_part part[NAV_MAPPER_PARTS];
    int parts;
};

struct nav_mapper {
    const struct nav_problem *problem;
    struct nav_mapper_options options;
    struct nav_record record;
    struct nav_particle_map hypothesis[NAV_MAPPER_HYPOTHESES];
    struct nav_course course;   /* of the likeliest */
    struct nav_kept challenger; /* takes all rows of this map again, with a lattice */
    bool challenged;            /* whether there is one */
    struct nav_lattice_search search;
    int sought; /* borders when a lattice was sought last */
    struct nav_kidnaps kidnaps;
};

/* The likeliest hypothesis. */
const struct nav_particle_map *nav_mapper_best(const struct nav_mapper *);

/* Goes on from this hypothesis and its course; the course that was in use is left in its place. */
void nav_mapper_adopt(struct nav_mapper *, struct nav_kept *);

#endif
