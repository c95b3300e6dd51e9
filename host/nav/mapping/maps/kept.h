/* A hypothesis with what its path left behind. */
#ifndef NAV_KEPT_H
#define NAV_KEPT_H

#include "cells.h"
#include "particle_map.h"
#include "trail.h"

/* What was read and felt along a path. */
struct nav_course {
    struct nav_trail trail;
    struct nav_cells cells;
    long row;       /* the first that it has not taken */
    double patches; /* log-likelihood of windows by patches before it was entered anew */
    bool entered;   /* anew, in the midst of its rows */
};

struct nav_kept {
    struct nav_particle_map map;
    struct nav_course course;
};

/* 0, or -1 without memory; nav_course_free either way. */
int nav_course_init(struct nav_course *, const struct nav_problem *);
void nav_course_free(struct nav_course *);

/* Begins at the origin, before this row. */
void nav_course_begin(struct nav_course *, long row);

/* Takes the row that `map` has just taken. */
void nav_course_follow(struct nav_course *, const struct nav_particle_map *map, const struct nav_record *,
                       const struct nav_record_row *);

/* Log-likelihood of its rows, or of those since it was entered anew, by a map; textures are explained by patches where
 * it has no lattice. */
double nav_course_evidence(const struct nav_course *, const struct nav_particle_map *map);

int nav_kept_init(struct nav_kept *, const struct nav_problem *);
void nav_kept_free(struct nav_kept *);
void nav_kept_begin(struct nav_kept *, long row);
void nav_kept_copy(struct nav_kept *, const struct nav_particle_map *, const struct nav_course *);

/* Takes its next row of the record. */
void nav_kept_take(struct nav_kept *, const struct nav_record *);

/* Goes on at a pose that is known so well. */
void nav_kept_enter(struct nav_kept *, struct nav_pose, double sigma_m, double sigma_rad);

#endif
