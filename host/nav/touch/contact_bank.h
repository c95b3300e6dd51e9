/* The hypotheses of contact_filter.h: begin, step by a block, tidy, and what one of them says. */
#ifndef NAV_CONTACT_BANK_H
#define NAV_CONTACT_BANK_H

#include "contact_filter.h"

/* A block, mirrored so that the tilt is positive: motion of the base (m), its turn (rad), duration, mean tilt (NAN: not
 * read) and the variance of its noise. */
struct nav_contact_step {
    double moved[2], turned, seconds, tilt, variance;
};

/* One hypothesis' view; SI units. */
struct nav_contact_seen {
    double point[2], point_cov[2][2], velocity[2], velocity_cov[2][2];
    double normal, normal_var, arc, arc_var, friction, friction_var, corner; /* the last: probability */
};

void nav_contact_bank_begin(struct nav_contact_filter *, const struct nav_contact_step *);

/* Drops the hypotheses that the block refutes; none may be left. */
void nav_contact_bank_step(struct nav_contact_filter *, const struct nav_contact_step *);

/* Drops what is improbable and joins what has become the same. */
void nav_contact_bank_tidy(struct nav_contact_filter *);

void nav_contact_bank_see(const struct nav_contact_filter *, const struct nav_contact_part *,
                          struct nav_contact_seen *);

#endif
