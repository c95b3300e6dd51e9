/* When a whisker touches something and when it lets go: threshold with hysteresis on deflection magnitude. */
#ifndef NAV_CONTACT_H
#define NAV_CONTACT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

/* cffi: begin */
struct nav_contact_config {
    double onset_counts;   /* a contact begins when the deflection stays above this ... */
    double release_counts; /* ... and ends when it stays below this; release_counts < onset_counts */
    int onset_samples;     /* for so many good samples in a row, at least 1 */
    int release_samples;   /* whiskers ring after release (16-60 Hz, whisker_physics section 5): a period is safe */
    int settle_samples;    /* the rest is the mean of so many first good samples */
    double
        rest_samples; /* time constant, in samples, with which the rest follows drift while nothing touches; what
                         stays between both thresholds for a fortieth of it is faster drift: no contact, or its end */
};

enum nav_contact_event { NAV_CONTACT_NONE, NAV_CONTACT_ONSET, NAV_CONTACT_RELEASE };

struct nav_contact {
    struct nav_contact_config config;
    double rest[2]; /* counts */
    double peak;    /* equation 2 over the present or, after a release, the last contact, counts */
    bool touching;
    int run;          /* good samples in a row beyond the threshold that would change `touching` */
    double run_peak;  /* largest deflection of that run */
    double between;   /* samples between the thresholds, less those below since */
    int settled;      /* good samples the rest was taken from so far */
    uint64_t skipped; /* samples that were not good */
};

void nav_contact_init(struct nav_contact *, const struct nav_contact_config *);

/* Takes one sample. A sample that is not good or not finite is skipped and counted: it neither begins, keeps nor ends
 * a contact. On a release `peak` holds the contact's peak. */
enum nav_contact_event nav_contact_update(struct nav_contact *, double alpha, double beta, bool good);

/* Takes samples [n][2] and good [n]; writes events [n] (enum nav_contact_event) and, at a release, peaks [n]. */
void nav_contact_run(struct nav_contact *, const double *samples, const uint8_t *good, size_t n, uint8_t *events,
                     double *peaks);
/* cffi: end */

#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif
