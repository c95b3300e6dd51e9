/* Room that a pass over the lattice works in: so many rows, each padded for what is read beyond its ends. */
#ifndef NAV_LATTICE_PASS_H
#define NAV_LATTICE_PASS_H

#include <stddef.h>

#include "lattice_rows.h"

enum { NAV_PASS_PAD = NAV_LANES, NAV_PASS_ROWS = 11 };

/* Floats of a row of nx cells. */
static inline size_t nav_pass_pitch(int nx)
{
    return (size_t)(nx + 2 * NAV_PASS_PAD + NAV_LANES);
}

#endif
