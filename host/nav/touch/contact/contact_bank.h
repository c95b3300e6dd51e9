/* The hypotheses of contact_filter.h: begin, step by a block, tidy, and what one of them says. */
#ifndef NAV_CONTACT_BANK_H
#define NAV_CONTACT_BANK_H

#include "contact_state.h"

/* What a hypothesis says: place, velocity, direction of the normal, arc length, coefficient of friction, curvature; SI.
 */
enum { SEEN_X, SEEN_Y, SEEN_VX, SEEN_VY, SEEN_NORMAL, SEEN_ARC, SEEN_FRICTION, SEEN_CURVATURE };

void nav_contact_bank_begin(struct nav_contact_filter *, const struct nav_contact_step *);

/* Drops the hypotheses that the block refutes; none may be left. */
void nav_contact_bank_step(struct nav_contact_filter *, const struct nav_contact_step *);

/* Drops what is improbable and joins what has become the same. */
void nav_contact_bank_tidy(struct nav_contact_filter *);

/* Mean and covariance of what a hypothesis says, by the names above. */
void nav_contact_bank_see(const struct nav_contact_filter *, const struct nav_contact_part *,
                          double mean[NAV_CONTACT_STATES], nav_contact_square cov);

/* Probability that the object is a corner. */
double nav_contact_bank_corner(const struct nav_contact_filter *, const struct nav_contact_part *);

#endif
