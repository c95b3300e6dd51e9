/* Whether a robot was carried off while it maps. */
#ifndef NAV_KIDNAP_H
#define NAV_KIDNAP_H

#include "kept.h"

enum { NAV_KIDNAP_DOUBTS = 64, NAV_KIDNAP_AGAIN = 2000 }; /* AGAIN: rows taken again at once, at most */

/* Log-likelihoods of a row by the map in use: of its contacts, of its windows, and of these by patches of any shape. */
struct nav_gained {
    double contacts, windows, patches;
};

/* A tile, and by how many nats patches explain its windows better. */
struct nav_doubt {
    int column, row;
    double nats;
};

struct nav_kidnap {
    struct nav_particle_map fresh; /* a map begun anew has taken the rows since `since` ... */
    long since;
    double felt;                               /* ... and explains their contacts by so many nats better, */
    struct nav_doubt doubt[NAV_KIDNAP_DOUBTS]; /* and windows of these tiles, */
    int doubts;
    double ratio;  /* all in all: a tile that is otherwise than mapped costs its prior once */
    double enough; /* nats at which it is looked into next */
    struct nav_gained gained[NAV_KIDNAP_AGAIN]; /* the last rows */
    struct nav_kept calm;                       /* the map in use, not long before `since` */
    struct nav_kept tried;
};

enum nav_kidnap_verdict {
    NAV_KIDNAP_NONE,
    NAV_KIDNAP_MENDED, /* none; but `tried`, after a slip or without tiles, explains the rows better */
    NAV_KIDNAP_CARRIED /* before the row that `calm`, the map of before it, would take next */
};

/* What a mapper holds after a row. */
struct nav_kidnap_view {
    const struct nav_record *record;
    const struct nav_particle_map *map; /* in use, with its course */
    const struct nav_course *course;
};

/* 0, or -1 without memory; nav_kidnap_free either way. */
int nav_kidnap_init(struct nav_kidnap *, const struct nav_problem *);
void nav_kidnap_free(struct nav_kidnap *);

/* Another map is in use: it is watched from the next row on. */
void nav_kidnap_begin(struct nav_kidnap *, const struct nav_kidnap_view *);

/* Takes a row after the map in use. */
enum nav_kidnap_verdict nav_kidnap_take(struct nav_kidnap *, const struct nav_kidnap_view *,
                                        const struct nav_record_row *, const struct nav_gained *);

/* Memory of all of it. */
size_t nav_kidnap_bytes(const struct nav_record *);

#endif
