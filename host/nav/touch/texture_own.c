#include "texture_own.h"

#include <math.h>
#include <stdlib.h>

bool nav_texture_own(const double **array, size_t n)
{
    const double *from = *array;
    double *copy = calloc(n + 1, sizeof *copy); /* no array is of size 0 */
    *array = copy;
    for (size_t i = 0; copy && i < n; i++) {
        if (!isfinite(from[i]))
            return false;
        copy[i] = from[i];
    }
    return copy != NULL;
}
