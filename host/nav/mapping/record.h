/* Rows as the mapper's particles take them, all of them kept: a new hypothesis begins at the first row. */
#ifndef NAV_RECORD_H
#define NAV_RECORD_H

#include "intake.h"

struct nav_record {
    const struct nav_problem *problem;
    struct nav_intake intake;
    int rays, tips, classes;
    int width;       /* numbers a row */
    long rows, most; /* taken; room for the last of them */
    float *cells;    /* [most][width] */
    double *moved;   /* [tips] m since the last window */
    double *ratio;   /* [codes] */
};

/* A reading of an object whisker. */
struct nav_record_contact {
    float distance;          /* m; INFINITY: no contact */
    float weight;            /* how much of it is new; 0: not read */
    float normal, normal_sd; /* rad; NAN: not reported */
};

/* One row of it; pointers into the record. */
struct nav_record_row {
    long number;
    struct nav_pose step;
    struct nav_noise noise;
    const struct nav_record_contact *contact; /* [rays] */
    const float *window;                      /* [tips][1 + classes]: m since the last one, below 0: not read; ratios */
};

/* 0, or -1 without memory; nav_record_free either way. */
int nav_record_init(struct nav_record *, const struct nav_problem *);
void nav_record_free(struct nav_record *);

/* Takes a row and keeps it; when the room is used up, in place of the oldest. Returns its number. */
long nav_record_take(struct nav_record *, const struct nav_row *);

/* Whether a row is still kept. */
bool nav_record_has(const struct nav_record *, long row);

struct nav_record_row nav_record_at(const struct nav_record *, long row);

/* Whether all rows so far are kept. */
bool nav_record_whole(const struct nav_record *);

/* Models of the object whiskers' distances: [rays]. */
const struct nav_model *nav_record_rays(const struct nav_record *);

size_t nav_record_bytes(const struct nav_record *);

#endif
