/* Where the map is wrong: tiles of another texture, boxes that are gone, things that it lacks.
 *
 * Learned online at poses of a belief (nav_map_learn, after a row was weighed), place by place, as the log-odds that a
 * place differs from the map. A place with enough evidence is taken to be what the readings say from then on, so that
 * one wrong place costs a belief its prior once, however often it is met; places found as mapped become surer of it. A
 * belief that turns out to have been wrong forgets it all (nav_map_forget). Nothing is allocated after the start. */
#ifndef NAV_MAP_BELIEF_H
#define NAV_MAP_BELIEF_H

#include "sensing.h"

#define NAV_MAP_TILE 6.0 /* nats: what it costs to believe that a tile differs from the map */

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
