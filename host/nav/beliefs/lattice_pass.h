/* Room that a pass over the lattice works in. */
#ifndef NAV_LATTICE_PASS_H
#define NAV_LATTICE_PASS_H

#include <stddef.h>

/* Floats of `rows` for rows of nx cells. */
size_t nav_lattice_row_floats(int nx);

#endif
