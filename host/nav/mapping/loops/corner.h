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

/* m along a face from its anchor to a point. */
double nav_corner_along(const struct nav_face *, const struct nav_corner_line *, double x, double y);

/* When corners of a map were felt last. */
enum { NAV_CORNERS_MOST = 64 };
struct nav_corners {
    int count;
    struct nav_corner_felt {
        long face[2]; /* their numbers, the lower first */
        struct nav_sighting then, last;
        bool open; /* this was after a way without it, and is not said yet */
    } felt[NAV_CORNERS_MOST];
};

/* Takes that face `g` was felt: its corner with `h` is, where that was felt shortly before. */
void nav_corners_feel(struct nav_corners *, const struct nav_face *g, const struct nav_face *h,
                      const struct nav_joint *);

#endif
