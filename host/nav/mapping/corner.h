/* Where two faces of a map meet. */
#ifndef NAV_CORNER_H
#define NAV_CORNER_H

#include "face.h"

/* A face as a line: normal . (x, y) = offset. */
struct nav_corner_line {
    double nx, ny, offset;
};

struct nav_corner {
    double x, y; /* m */
    double sine; /* of the angle between the two */
    struct nav_corner_line line[2];
};

/* Whether two faces make a corner: they meet at a wide angle, and a stretch of each that was felt ends near there. */
bool nav_corner_find(const struct nav_face *, const struct nav_face *, const struct nav_joint *,
                     struct nav_corner *out);

#endif
