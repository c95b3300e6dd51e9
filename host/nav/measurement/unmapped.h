/* What a sensor meets on ground that nobody mapped: one unknown thing after the other, each for a while.
 *
 * Readings there are not independent: those of one tile share its texture. Their likelihood is that of a hidden Markov
 * model whose state is what lies at the sensor, which its path replaces by a draw from what the map has. It
 * is the same for every pose on such ground, and a distribution over readings like that of any mapped one. */
#ifndef NAV_UNMAPPED_H
#define NAV_UNMAPPED_H

#include "sensing.h"

/* 0, or -1 without memory; nav_unmapped_free either way. */
int nav_unmapped_init(struct nav_unmapped *, int states);
void nav_unmapped_free(struct nav_unmapped *);

/* Adds `weight` to the share that one of a sensor's states has of the map; nav_unmapped_begin makes shares of them. */
void nav_unmapped_count(struct nav_unmapped *, int state, double weight);

/* Nothing was read yet, or what was read is of another place. */
void nav_unmapped_begin(struct nav_unmapped *, double run_m);

/* Logarithm of p(reading | the readings before it, ground not mapped), after `moved` m of path since the last one; in
 * u->loglik: of the reading by each state. */
double nav_unmapped_take(struct nav_unmapped *u, double moved);

#endif
