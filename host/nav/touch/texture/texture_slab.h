/* One piece of memory for an object and all of its arrays.
 *
 * An object's `place` function says which arrays it has. It is called twice: first to count, without memory, then to
 * cut each array from the piece. A free() of the object frees all.
 */
#ifndef NAV_TEXTURE_SLAB_H
#define NAV_TEXTURE_SLAB_H

#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

struct nav_texture_slab {
    double *at; /* NULL while arrays are counted */
    size_t used;
    bool refused; /* a number to copy is not finite */
};

/* An array of n zeros, at first; NULL while arrays are counted. */
static inline double *nav_texture_slab_cut(struct nav_texture_slab *m, size_t n)
{
    double *part = m->at ? m->at + m->used : NULL;
    m->used += n;
    return part;
}

/* Replaces the caller's array by a copy; all of its numbers must be finite. An array of length 0 may be NULL. */
static inline void nav_texture_slab_copy(struct nav_texture_slab *m, const double **array, size_t n)
{
    double *part = nav_texture_slab_cut(m, n);
    for (size_t i = 0; i < n; i++)
        m->refused |= !isfinite((*array)[i]);
    if (part && n > 0)
        memcpy(part, *array, n * sizeof *part);
    if (part)
        *array = part;
}

/* A new object like the one given, of so many bytes, with its arrays. NULL without memory or for an array to be copied
 * that is not finite. */
static inline void *nav_texture_slab_new(void *like, size_t size, void (*place)(void *, struct nav_texture_slab *))
{
    struct nav_texture_slab m = {0};
    place(like, &m);
    char *made = m.refused ? NULL : calloc(1, size + m.used * sizeof *m.at);
    if (!made)
        return NULL;
    memcpy(made, like, size);
    m = (struct nav_texture_slab){.at = (double *)(made + size)};
    place(made, &m);
    return made;
}

#endif
