/* Whether the robot is where the local belief has it.
 *
 * Two explanations of the rows are compared: the local belief's, and that of a robot anywhere in free space. While the
 * arena-wide belief sleeps, "anywhere" is a hidden Markov model of each whisker (unmapped.h): what it meets is drawn
 * from the arena, and stays for a while. Without that, any belief that follows the readings would explain them better
 * than "anywhere", wherever it is. The running log-ratio never falls below 0, and the row after its last 0 is when the
 * robot would have been moved (Page's test). When the arena-wide belief is awake its own likelihood of the rows takes
 * over.
 *
 * A local belief may explain a disagreement by a broken whisker (trust.h). In another place that whisker works as well
 * as it did before: the trust of that time is kept for the other explanation. */
#ifndef NAV_ADAPTIVE_KIDNAP_H
#define NAV_ADAPTIVE_KIDNAP_H

#include "likelihood.h"
#include "rng.h"
#include "unmapped.h"

struct adaptive_kidnap {
    int whiskers;
    float **share;            /* [whiskers][codes] of free space that expects the code */
    struct nav_unmapped *any; /* [whiskers] what is met: codes that stay alike make one state */
    double *trust;            /* [whiskers] before row `since` */
    double ratio;             /* log of rows since `since` by "anywhere" and by the local belief; at least 0 */
    uint64_t since;           /* row of the log */
    double proven;            /* log of rows by the local belief and by "anywhere" since it was found; at least 0 */
};

/* 0, or -1 without memory; adaptive_kidnap_free either way. */
int adaptive_kidnap_init(struct adaptive_kidnap *, struct nav_likelihood *, struct nav_rng *);
void adaptive_kidnap_free(struct adaptive_kidnap *);

/* Log-likelihood of the row last read for a robot anywhere; moved[whiskers]: path since the reading before, m. */
double adaptive_kidnap_anywhere(struct adaptive_kidnap *, const struct nav_likelihood *, const double *moved);

/* Takes row `row`, explained by both. */
void adaptive_kidnap_take(struct adaptive_kidnap *, const struct nav_likelihood *, uint64_t row, double anywhere,
                          double local);

/* Starts again at row `row`, with the trust in whiskers that there is. */
void adaptive_kidnap_clear(struct adaptive_kidnap *, const struct nav_likelihood *, uint64_t row);

/* Gives the trust before row `since` to another belief, and how windows of texture are to be read. */
void adaptive_kidnap_teach(const struct adaptive_kidnap *, const struct nav_likelihood *from,
                           struct nav_likelihood *to);

#endif
