/* The adaptive filter's beliefs begun from a mixture of bumps. */
#ifndef NAV_ADAPTIVE_PRIOR_H
#define NAV_ADAPTIVE_PRIOR_H

#include "adaptive_global.h"
#include "bumps.h"

/* Draws hypotheses from the prior's bumps and leaves the arena-wide belief uniform. False when the bumps are too wide
 * for a cloud, or nothing of them is free: the arena-wide belief then holds them instead. */
bool adaptive_prior_cloud(struct adaptive_cloud *, const struct nav_likelihood *, struct adaptive_global *);

#endif
