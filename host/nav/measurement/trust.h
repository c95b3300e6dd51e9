/* Which whiskers can be believed: learned online from how readings agree with what a filter expected.
 *
 * Each whisker is taken to work or to be broken, with a small chance of changing. A filter reports, before it uses a
 * row, what its belief expects (nav_trust_begin, nav_trust_add for poses of that belief), then lets the row's readings
 * be judged (nav_trust_learn). Belief not listed counts as expecting nothing in particular, so that an unsure filter
 * teaches nothing. A disagreement counts against a whisker only while the other whiskers agree with the belief: when
 * all disagree it is the belief that is wrong. The next row's tables use the outcome. How much of the belief expected a
 * reading is noted for repeat.h. */
#ifndef NAV_TRUST_H
#define NAV_TRUST_H

#include "sensing.h"

/* 0, or -1 without memory. */
int nav_trust_init(struct nav_trust *, int codes);
void nav_trust_free(struct nav_trust *);

/* The whisker is trusted as at the start. */
void nav_trust_restore(struct nav_trust *);

/* Starts a row's expectation. */
void nav_trust_begin(struct nav_likelihood *);

/* Adds one pose's share: codes[whiskers] it expects, and its mass (masses of a row sum to at most 1). */
void nav_trust_add(struct nav_likelihood *, const uint8_t *codes, double mass);

/* Judges the readings last read (nav_likelihood_read) by the expectation. Texture whiskers learn their accuracy, too,
 * which the automatic temper uses. */
void nav_trust_learn(struct nav_likelihood *);

#endif
