/* A sequence of tiles of the floor that are read again after a way without them: whether the robot is in the place that
 * it believes, or the tiles are others. */
#ifndef NAV_SEQUENCE_H
#define NAV_SEQUENCE_H

#include "particle_map.h"

enum { NAV_SEQUENCE_MOST = 24 };

/* A tile that is read again, as it was before. */
struct nav_sequence_visit {
    int column, row;
    struct nav_sighting then;
};

struct nav_sequence {
    int classes, begun;        /* begun: of the floor whose tiles these are */
    float *before;             /* [SIDE][SIDE][classes] log-likelihoods of tiles, by sequences that are over */
    struct nav_sighting *last; /* [SIDE][SIDE] of tiles; row -1: never */
    double spread[3];          /* m^2: covariance of the place in the lattice, before the sequence */
    double spread_way;         /* m of way when it was that */
    int visits;
    struct nav_sequence_visit visit[NAV_SEQUENCE_MOST];
    float *sum;                 /* [MOST][classes] log-likelihoods of the visits' windows */
    double read_way;            /* m of way when one of its tiles was read last */
    struct nav_closure closure; /* by the tiles before the last one, as of row `weighed` */
    long weighed;
};

/* 0, or -1 without memory; nav_sequence_free either way. */
int nav_sequence_init(struct nav_sequence *, int classes);
void nav_sequence_free(struct nav_sequence *);
void nav_sequence_clear(struct nav_sequence *);

/* Becomes equal, of as many classes. */
void nav_sequence_copy(struct nav_sequence *to, const struct nav_sequence *from);

/* The sequence is over: it was said, or the robot was carried. */
void nav_sequence_end(struct nav_sequence *);

/* Takes the windows of the row that `map` has just taken. */
void nav_sequence_take(struct nav_sequence *, const struct nav_particle_map *map, const struct nav_record *,
                       const struct nav_record_row *);

size_t nav_sequence_bytes(int classes);

#endif
