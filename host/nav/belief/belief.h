/* Judging beliefs, given as components (nav_filter_components): regions of highest density.
 *
 * A component is drawn as a square of even density with the component's standard deviation, so that the cells of a grid
 * tile the floor: components of one belief should overlap, sigma at least their spacing / sqrt(12). Allocates; not for
 * the timed path. */
#ifndef NAV_BELIEF_H
#define NAV_BELIEF_H

#include "problem.h"

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

/* cffi: begin */
struct nav_region {
    double level;   /* mass of the smallest region of highest density in (x, y) that holds the point */
    double area_m2; /* of the region of highest density that holds 0.9 of the mass */
};

/* Region figures of n components at the point (x, y), m, which lies in the 90 % region if its level is at most 0.9; its
 * own bin counts half. -1: no memory or no mass, and a level of 1. */
int nav_belief_region(const struct nav_component *, long n, double x, double y, struct nav_region *);
/* cffi: end */

#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif
