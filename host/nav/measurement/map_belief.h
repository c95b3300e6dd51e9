/* Where the map is wrong: tiles of another texture, boxes that are gone, things that it lacks.
 *
 * Learned online at poses of a belief (nav_map_learn, after a row was weighed), place by place, as the log-odds that a
 * place differs from the map. A place with enough evidence is taken to be what the readings say from then on, so that
 * one wrong place costs a belief its prior once, however often it is met; places found as mapped become surer of it. A
 * belief that turns out to have been wrong forgets it all (nav_map_forget). Nothing is allocated after the start. */
#ifndef NAV_MAP_BELIEF_H
#define NAV_MAP_BELIEF_H

#include <stddef.h>
#include <stdint.h>

#include "measurement.h"

struct nav_likelihood;

enum { NAV_MAP_THINGS = 32 };

/* Nats for `other` against the mapped texture, less those of the prior. */
struct nav_map_tile {
    float nats;
    uint8_t other;
};

/* Something solid that the map lacks was felt here. */
struct nav_map_thing {
    double x, y, nats;
};

/* What may be wrong: a tile, a box, or that nothing is at a point. */
enum nav_map_kind { NAV_MAP_TILE, NAV_MAP_BOX, NAV_MAP_THING };

/* The place that a sensor's reading tells of, and how much of the belief has it tell of that. */
struct nav_map_suspect {
    enum nav_map_kind kind;
    int which; /* tile or box; -1: none */
    double x, y, mass;
};

struct nav_map_belief {
    const struct nav_arena *reported;
    struct nav_arena arena; /* as believed, but for boxes */
    uint8_t *floor;         /* its textures */
    struct nav_map_tile *tile;
    float *gone; /* [boxes] nats for its absence, less those of the prior */
    struct nav_map_thing thing[NAV_MAP_THINGS];
    int things;                      /* kept */
    struct nav_map_suspect *suspect; /* [sensors] of the present row */
    double mass;                     /* of the poses added */
};

/* 0, or -1 without memory; nav_map_free either way. */
int nav_map_init(struct nav_map_belief *, const struct nav_arena *reported, size_t sensors);
void nav_map_free(struct nav_map_belief *);
size_t nav_map_bytes(const struct nav_map_belief *);

/* Starts a row. */
void nav_map_begin(struct nav_likelihood *);

/* Adds a pose, drawn from the belief before the row: codes[sensors] it expects, and its mass. */
void nav_map_add(struct nav_likelihood *, const struct nav_place *, const uint8_t *codes, double mass);

/* Learns from the row, given what the belief expects (nav_trust_add). */
void nav_map_learn(struct nav_likelihood *);

/* The map is again as given. */
void nav_map_forget(struct nav_likelihood *);

/* Contacts of the row last read that nothing mapped explains, but something else may: their codes become "not known".
 */
void nav_map_apply(const struct nav_likelihood *, const struct nav_place *, uint8_t *codes);

#endif
