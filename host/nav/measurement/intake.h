/* Rows as they come into what filters take: cleans cells, orders rows, and says how new each reading is. */
#ifndef NAV_INTAKE_H
#define NAV_INTAKE_H

#include <stdbool.h>
#include <stdint.h>

#include "gap.h"
#include "likelihood.h"
#include "motion.h"
#include "problem.h"

enum { NAV_ROWS_KEPT = 64 };

struct nav_intake {
    const struct nav_problem *problem;
    uint64_t bad_cells, bad_rows;
    uint64_t empty;                /* windows that call all textures equally likely */
    uint64_t marks[NAV_ROWS_KEPT]; /* of all numbers of the last rows, to know one that is delivered twice */
    long rows;
    double latest; /* s */
    int untimed;   /* rows since whose motion is known, but not their time: they are not missing */
    struct nav_gaps gaps;
    struct nav_sensors sensors;
    struct nav_track *track; /* [sensors] */
    struct nav_repeat repeat;
    double *values; /* storage of the readings */
    const double **reading;
    double *weight, *moved;
};

/* Whether a row says that the robot was carried. */
bool nav_row_carried(const struct nav_row *);

int nav_intake_init(struct nav_intake *, const struct nav_problem *);
void nav_intake_free(struct nav_intake *);

/* Fills motion and evidence (which points into the intake) from one row. Returns whether anything new was read. */
bool nav_intake_take(struct nav_intake *, const struct nav_row *, struct nav_motion *, struct nav_evidence *);

#endif
