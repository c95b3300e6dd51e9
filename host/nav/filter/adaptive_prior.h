/* The adaptive filter's histogram begun from a mixture of bumps. */
#ifndef NAV_ADAPTIVE_PRIOR_H
#define NAV_ADAPTIVE_PRIOR_H

#include "adaptive_global.h"
#include "bumps.h"

/* Writes the mixture of the prior out. Returns how many equal cells it is worth. */
double adaptive_global_fill(struct adaptive_global *);

#endif
