/* One particle: a path that is drawn, the map that goes with it, and a Gaussian since the path's last pose. */
#ifndef NAV_GRID_PARTICLE_H
#define NAV_GRID_PARTICLE_H

#include "grid_motion.h"
#include "grid_rows.h"

struct nav_grid_particle {
    struct nav_pose from;         /* the last pose that was drawn */
    struct nav_grid_gaussian now; /* where it is, given that */
    double scale;                 /* of the odometry's noise, ratio of standard deviations */
    double weight;                /* log, but for a constant */
    /* Direction of the world's right angles and its variance, rad and rad^2; faces along them and others, as counted,
     * the prior's included. */
    double axes, axes_var, right, refused;
    struct nav_grid_map map;
};

struct nav_grid_odometry nav_grid_particle_odometry(const struct nav_grid_particle *, const struct nav_grid_rows *);

/* Begins at the origin; keeps scale and map. */
void nav_grid_particle_begin(struct nav_grid_particle *, const struct nav_grid_rows *);

/* Draws the pose at the last row and the path to it, and learns the rows. surface: poses are proposed where contacts
 * lie on surfaces of the map, too; else by the odometry alone. */
void nav_grid_particle_draw(struct nav_grid_particle *, struct nav_grid_pool *, const struct nav_grid_rows *,
                            bool surface, struct nav_rng *);

#endif
