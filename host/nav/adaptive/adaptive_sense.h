/* What hypotheses anywhere in the arena should meet, worked out when asked: exact poses, each signature weighed once.
 *
 * A map of coarse squares lists the boxes within reach of a robot there. Where there are none, and no wall, no ray is
 * cast; hypotheses that expect the same codes share one look-up of the row's tables (a signature, see expected.h). */
#ifndef NAV_ADAPTIVE_SENSE_H
#define NAV_ADAPTIVE_SENSE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "filter.h"
#include "likelihood.h"

struct adaptive_sense {
    const struct nav_arena *arena;
    const struct nav_robot *robot;
    struct nav_likelihood *likelihood;
    const struct nav_evidence *evidence; /* of the present row */
    double *bearing;                     /* [rays][2] cosine and sine of each ray's yaw */
    double edge;                         /* of a square, m */
    int columns, rows;
    uint32_t *first;     /* [rows * columns + 1] its boxes are number first[n] .. first[n + 1] - 1 */
    struct nav_box *box; /* copies, square by square */
    uint8_t *wall;       /* [rows * columns] whether a wall is within reach */
    size_t slots;        /* of the book of signatures, a power of two */
    uint32_t *stamp;     /* [slots] row in which the slot was filled */
    uint8_t *codes;      /* [slots][whiskers] */
    float *value;        /* [slots] log-likelihood of the present row */
    uint32_t *filled;    /* [slots] the first `distinct` are the present row's slots */
    double *mass;        /* [slots] belief that expects the signature, or its likelihood: a cloud's scratch */
    uint8_t *scratch;    /* [whiskers] */
    uint32_t row;
    long distinct; /* signatures weighed for the present row */
};

/* most: poses that may be asked about per row. 0, or -1 without memory; adaptive_sense_free either way. */
int adaptive_sense_init(struct adaptive_sense *, const struct nav_problem *, size_t most);
void adaptive_sense_free(struct adaptive_sense *);

/* Takes a row's readings, which must stay until the next. */
void adaptive_sense_read(struct adaptive_sense *, const struct nav_evidence *);

/* Slot (index into value) of the signature at (x, y) with the heading's cosine and sine. */
uint32_t adaptive_sense_at(struct adaptive_sense *, double x, double y, double c, double s);

/* What a pose expects: codes[whiskers]. */
void adaptive_sense_codes(const struct adaptive_sense *, double x, double y, double c, double s, uint8_t *codes);

/* Whether the robot may stand at (x, y), the body taken `grace` m smaller. */
bool adaptive_sense_free_at(const struct adaptive_sense *, double x, double y, double grace);

size_t adaptive_sense_bytes(const struct adaptive_sense *);

#endif
