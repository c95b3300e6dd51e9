/* What a grid map expects of whiskers, and what it learns from them. */
#ifndef NAV_GRID_SENSE_H
#define NAV_GRID_SENSE_H

#include <stdbool.h>

#include "grid_map.h"

/* A map to read or to write. */
struct nav_grid {
    struct nav_grid_pool *pool;
    struct nav_grid_map *map;
};

/* A whisker as it lies in the world, and how it errs. */
struct nav_grid_whisker {
    double x, y;   /* its base, m */
    double c, s;   /* its direction */
    double length; /* m */
    double sigma;  /* m of a contact along it */
    double miss;   /* share of contacts that are not noticed */
    double ghost;  /* share of readings that report a contact with nothing */
};

/* The surface about a place, as straight as its contacts are. */
struct nav_grid_surface {
    double x, y;       /* m, amid the contacts */
    double nx, ny;     /* its normal, against the whisker */
    double facing;     /* cosine between normal and whisker */
    double variance;   /* m^2, of the next contact along the normal */
    double normal_var; /* rad^2 */
    double there;      /* probability that there is one */
};

/* False: nothing was felt near. */
bool nav_grid_surface(struct nav_grid, double x, double y, const struct nav_grid_whisker *,
                      struct nav_grid_surface *out);

/* Density (1 / m, along the whisker) of a contact with this surface, `off` m from it along the normal, whose place is
 * known to `variance` m^2. */
double nav_grid_of_surface(const struct nav_grid_surface *, const struct nav_grid_whisker *, double off,
                           double variance);

/* Density of a contact at `distance` with something that is not in the map, a ghost included. */
double nav_grid_of_others(struct nav_grid, const struct nav_grid_whisker *, double distance);

/* Log-likelihood of a reading: density of a contact over that of one anywhere on the whisker, or probability that it
 * touches nothing. distance: INFINITY without contact. */
double nav_grid_contact(struct nav_grid, const struct nav_grid_whisker *, double distance);

/* Learns a reading; weight: how much of it is new. */
void nav_grid_learn_contact(struct nav_grid, const struct nav_grid_whisker *, double distance, double weight);

/* Log-likelihood of a window at a place: ratio[k] = p(window | texture k) / p(window | any). */
double nav_grid_texture(struct nav_grid, double x, double y, const float *ratio);
void nav_grid_learn_texture(struct nav_grid, double x, double y, const float *ratio);

#endif
