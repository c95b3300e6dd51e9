/* One hypothesis of a mapper: a Gaussian over pose and map, by a trust in the odometry of its own. */
#ifndef NAV_PARTICLE_MAP_H
#define NAV_PARTICLE_MAP_H

#include "faces.h"
#include "floor.h"
#include "record.h"

enum { NAV_HYPOTHESES = 12 };

struct nav_particle_map {
    struct nav_joint joint;
    struct nav_faces faces;
    struct nav_floor floor;
    struct nav_touches touches;
    double evidence; /* log-likelihood of its rows */
    double scale;    /* of the odometry's noise, ratio of standard deviations */
};

/* 0, or -1 without memory; nav_particle_map_free either way. */
int nav_particle_map_init(struct nav_particle_map *, int classes);
void nav_particle_map_free(struct nav_particle_map *);

/* Begins at the origin, where nothing is known; keeps its scale. */
void nav_particle_map_begin(struct nav_particle_map *);

/* Becomes equal but for the scale. */
void nav_particle_map_copy(struct nav_particle_map *to, const struct nav_particle_map *from);

/* Takes a row. */
void nav_particle_map_take(struct nav_particle_map *, const struct nav_record *, const struct nav_record_row *);

struct nav_pose nav_particle_map_pose(const struct nav_particle_map *);

/* The scales of a mapper's hypotheses. */
double nav_hypothesis_scale(int number);

size_t nav_particle_map_bytes(int classes);

#endif
