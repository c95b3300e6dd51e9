/* A robot that is carried off while it maps: noticed, a second map begun, and joined with the first when they meet. */
#ifndef NAV_KIDNAP_H
#define NAV_KIDNAP_H

#include "mapper_state.h"

/* 0, or -1 without memory; nav_kidnap_free either way. */
int nav_kidnap_init(struct nav_kidnaps *, const struct nav_problem *);
void nav_kidnap_free(struct nav_kidnaps *);

/* After the hypotheses have taken a row: what the likeliest gained by its contacts and by its windows, and what patches
 * of any shape would have gained by the windows. */
void nav_kidnap_take(struct nav_mapper *, const struct nav_record_row *, double contacts, double windows,
                     double patches);

/* The evidence of all hypotheses has begun anew. */
void nav_kidnap_restart(struct nav_mapper *);

/* Memory of all of it. */
size_t nav_kidnap_bytes(const struct nav_record *);

#endif
