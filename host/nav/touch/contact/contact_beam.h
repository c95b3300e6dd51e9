/* Table of a tapered whisker bent by one force, solved exactly (elastica), with derivatives.
 *
 * The whisker is clamped with its unbent axis along x; lengths are in cones (from the follicle's exit to the point of
 * the cone), moments in E I0/cone, so that Young's modulus drops out. Two tables: a force on the shaft, over the arc
 * length at the contact, the slope there and the friction ratio nu (force along the whisker towards its tip over force
 * across it); and a force at the tip of any direction, over that direction and the slope.
 */
#ifndef NAV_CONTACT_BEAM_H
#define NAV_CONTACT_BEAM_H

#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

#define NAV_BEAM_DIRECTION 2.85 /* rad: largest direction of a force on the tip in the table */

/* cffi: begin */
enum {
    NAV_BEAM_ARCS = 24,
    NAV_BEAM_SLOPES = 16,
    NAV_BEAM_DIRECTIONS = 20,
    NAV_BEAM_FIELDS = 3,
    NAV_BEAM_POWERS = 3,
    NAV_BEAM_VALUES = NAV_BEAM_FIELDS * NAV_BEAM_POWERS
};

struct nav_contact_beam {
    double tip; /* arc length of the tip, cones */
    float shaft[NAV_BEAM_ARCS][NAV_BEAM_SLOPES][NAV_BEAM_VALUES + 3];
    float end[NAV_BEAM_DIRECTIONS][NAV_BEAM_SLOPES][4];
};

/* Place of the contact and moment at the base; by[k]: derivatives by the coordinates (arc or direction; slope; nu). */
struct nav_contact_bend {
    double x, y, moment;
    double by[3][3];
};

/* Works the tables out for a whisker of this length over cone, 0.3 to 0.85 (some 10 ms). false: no such whisker. */
bool nav_contact_beam_make(struct nav_contact_beam *, double tip);

/* false: outside the table; coordinates are then held to its edge. Slope >= 0, rad; nu -0.5 to 0.5. */
bool nav_contact_beam_shaft(const struct nav_contact_beam *, double arc, double slope, double nu,
                            struct nav_contact_bend *);

/* direction: of the force on the tip about the clamped axis, rad; 0.6 to 2.85. */
bool nav_contact_beam_end(const struct nav_contact_beam *, double direction, double slope, struct nav_contact_bend *);
/* cffi: end */

#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif
