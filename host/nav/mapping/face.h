/* One straight face of a map, a normal on its free side, as two numbers of a joint Gaussian: the direction of the
 * normal and the offset along it from an anchor. */
#ifndef NAV_FACE_H
#define NAV_FACE_H

#include <stdbool.h>
#include <stdint.h>

#include "joint.h"
#include "touches.h"

enum { NAV_FACE_CELLS = 128 };

struct nav_face {
    int index;                 /* of its direction in the joint; the offset is the next */
    double anchor_x, anchor_y; /* m */
    double low, high;          /* m along it from the anchor, to the left as one looks along the normal: felt */
    uint64_t felt[NAV_FACE_CELLS / 64]; /* a bit for each 5 cm of it that was felt, the anchor in the middle */
    double hits, missed;                /* contacts; whiskers that went through it */
    bool right;                         /* at right angles with the axes */
};

/* A point with a whisker's direction, as seen from a face. */
struct nav_face_view {
    double off, along;    /* m from the face, and along it from the anchor */
    double facing, slant; /* components of the whisker's direction, against the normal and along the face */
    double variance;      /* m^2 of `off` by the joint */
    struct nav_linear form;
};

/* False: the point is far away, or the whisker comes from behind. */
bool nav_face_look(const struct nav_face *, const struct nav_joint *, const struct nav_touch *, struct nav_face_view *);

/* Likelihood of a contact by a face, 1 / m along the whisker; noise: variance of its place along the normal. */
double nav_face_likelihood(const struct nav_face *, const struct nav_face_view *, double noise);

/* Noise of a point's place along the normal, m^2; sigma: along the whisker. */
double nav_face_noise(const struct nav_face_view *, double sigma);

/* Marks what was felt, m along it. */
void nav_face_feel(struct nav_face *, double low, double high);

/* Whether all of it about a place was felt. */
bool nav_face_felt(const struct nav_face *, double along, double within);

/* The first stretch of it that was felt from cell `from` on, m along it. Returns the cell after it, 0: there is none.
 */
int nav_face_stretch(const struct nav_face *, int from, double *low, double *high);

/* m from there to what was felt. */
double nav_face_beyond(const struct nav_face *, double along);

/* 1 over the length in which a face is found to go on, 1 / m. */
double nav_face_decay(const struct nav_face *);

/* Whether a younger face is this one felt again; then it has corrected this one, and may be removed. */
bool nav_face_join(struct nav_face *, const struct nav_face *younger, struct nav_joint *);

double nav_face_normal_density(double off, double variance);

#define NAV_FACE_GATE 12.0       /* squared standard deviations from it of what is of it */
#define NAV_FACE_RIGHT_RAD 0.006 /* standard deviation of right angles */
#define NAV_FACE_ROUGH_M 0.001   /* of any face */
#define NAV_FACE_NEW_PER_M 0.03  /* density of faces not in the map, where one that is has 1 */

#endif
