/* What readings tell of which hypothesis is true.
 *
 * With hypotheses of equal weight whose readings z are distributed as p_i, I(hypothesis; z) is at least
 * -mean_i log mean_j exp(-D_ij), with D the Bhattacharyya distance of p_i and p_j (Kolchinsky and Tracey, Estimating
 * Mixture Entropy with Pairwise Distances, Entropy 19, 2017). Readings of successive steps count as independent given
 * the hypothesis, so that distances add up. They are kept in eighths of a nat, at most 255 of them. */
#ifndef NAV_INFORMATION_H
#define NAV_INFORMATION_H

#include <stdbool.h>
#include <stdint.h>

enum { NAV_INFORMATION_PER_NAT = 8, NAV_INFORMATION_LEVELS = 256, NAV_INFORMATION_NOTHING = 255 };

/* A pair's share exp(-D) by its distance. */
void nav_information_shares(float share[NAV_INFORMATION_LEVELS]);

/* Adds `units` to apart[n][stride] between all hypotheses whose codes[n] differ by more than `slack` and are none of
 * them NAV_INFORMATION_NOTHING. False: all codes are equal. */
bool nav_information_differ(uint8_t *apart, int n, int stride, const uint8_t *codes, uint8_t slack, uint8_t units);

/* Adds `units` for those that are true while they go on, against those of stopped[n] that should not have. What stops
 * is no reading: one that stands still refutes nothing by it. False: none is stopped, or all are. */
bool nav_information_refute(uint8_t *apart, int n, int stride, const uint8_t *stopped, uint8_t units);

/* Bits that distances apart[n][stride] tell of the place, of hypotheses that are in one place where same[n][stride]
 * is 1. What readings tell beyond the place is taken off: the information about the hypothesis less that about the
 * hypothesis given its place. first .. last - 1: those taken to be true in turn. */
double nav_information_bits(const uint8_t *apart, const uint8_t *same, int n, int stride, int first, int last,
                            const float share[NAV_INFORMATION_LEVELS]);

#endif
