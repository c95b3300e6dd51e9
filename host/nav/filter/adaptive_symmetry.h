/* Arenas that look the same when turned about their centre. */
#ifndef NAV_ADAPTIVE_SYMMETRY_H
#define NAV_ADAPTIVE_SYMMETRY_H

#include "arena.h"

/* 4 when a quarter turn about the centre changes nothing a whisker could tell, 2 when half a turn does, else 1. */
int adaptive_symmetry(const struct nav_arena *);

#endif
