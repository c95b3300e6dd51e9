/* The likelihood of the present row at any pose, for filters that weigh poses one by one.
 *
 * The same answer as nav_likelihood_expect and nav_likelihood_of, quicker: whiskers that read nothing new are left out,
 * and where nothing solid is within reach of any whisker, known from a map of clearances, no ray is cast. */
#ifndef NAV_PROBE_H
#define NAV_PROBE_H

#include "filter.h"
#include "likelihood.h"

struct nav_probe {
    const struct nav_arena *arena;
    const struct nav_robot *robot;
    struct nav_likelihood *likelihood;
    int columns, rows;  /* of the clearance map */
    double cell, per_m; /* m, and cells per m */
    float *clearance;   /* [rows][columns] lower bound of the distance from any point of the cell to a solid, m */
    double reach;       /* from the robot's centre to the farthest point that a whisker can sense, m */
    double *bearing;    /* [rays][2] cosine and sine of each ray's yaw */
    int *active;        /* whiskers read by the present row: texture whiskers, then object whiskers */
    int active_tips, active_whiskers;
    double nothing; /* log-likelihood of the row's object whiskers where nothing is within reach */
    double ceiling; /* of the row at the pose that would suit every whisker best */
};

/* blur_m as in nav_likelihood_new. 0, or -1 without memory; nav_probe_free either way. */
int nav_probe_init(struct nav_probe *, const struct nav_problem *, double blur_m);
void nav_probe_free(struct nav_probe *);

/* Takes a row's readings. */
void nav_probe_read(struct nav_probe *, const struct nav_evidence *);

/* Whether the robot's body stands free at (x, y). */
bool nav_probe_free_at(const struct nav_probe *, double x, double y);

/* Log-likelihood of the row at (x, y) with the heading's cosine and sine; -INFINITY where the robot cannot stand. */
double nav_probe_at(const struct nav_probe *, double x, double y, double c, double s);

size_t nav_probe_bytes(const struct nav_probe *);

#endif
