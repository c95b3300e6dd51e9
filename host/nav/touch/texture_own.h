/* Arrays of numbers that a model keeps for itself. */
#ifndef NAV_TEXTURE_OWN_H
#define NAV_TEXTURE_OWN_H

#include <stdbool.h>
#include <stddef.h>

/* Replaces the caller's array by a copy, the new owner's to free either way; false if it holds something that is not
 * finite or memory is short. */
bool nav_texture_own(const double **array, size_t n);

#endif
