/* What whiskers truly touch: for truth files and tests, never for decisions. */
#ifndef SIM_CONTACT_H
#define SIM_CONTACT_H

#include <stdbool.h>
#include <stddef.h>

/* cffi: begin */
/* What an object whisker touches. */
struct sim_contact {
    bool touching;         /* false too once the whisker has slipped off */
    bool corner;           /* true: the shaft on a corner; false: the tip on a face or a wall */
    double radius_m;       /* radial distance of the contact from the whisker's base */
    double theta_rad;      /* imposed angle, positive when the whisker pushes to its left */
    double amplitude_gain; /* 1 + this contact's deviation of the whisk amplitude */
};

/* Where a texture whisker's tip is on the floor. */
struct sim_tip {
    double x, y;        /* m, arena frame */
    size_t texture;     /* index in the scene's textures of the nearest tile */
    double inside_m;    /* distance to the nearest border of its tile; 0 beyond a wall */
    double travelled_m; /* length of the tip's path since the start */
    bool caught;        /* an edge between tiles holds it back behind that place */
};
/* cffi: end */

#endif
