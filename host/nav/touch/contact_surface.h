/* Is what a whisker met a corner under its shaft or a face at its tip, and how does the face lie?
 *
 * The same object is met twice: by driving forward, and by turning on the spot. A corner pushes the whisker across
 * itself, at an unknown radius; a face pushes the tip, at a known radius, along the face's unknown normal. Each kind
 * has one unknown and predicts both bendings, so the kinds can be told apart and the unknown be found. Two dimensions;
 * robot frame x forward, y left; angles anticlockwise.
 */
#ifndef NAV_CONTACT_SURFACE_H
#define NAV_CONTACT_SURFACE_H

/* cffi: begin */
/* How a whisker is mounted and how it bends: ln of tilt per angle pushed at radius a is ln h(a) of radial_whisk.h. */
struct nav_surface_mount {
    double base_m[2], yaw_rad, length_m;
    double kappa, cone_mm;
    double spread;                        /* relative standard deviation of a bending */
    double corner_low_mm, corner_high_mm; /* radii at which a corner may lie */
};

/* What was seen: bending (any unit, signed: positive when the whisker bends clockwise, pushed from its left) per metre
 * driven and per radian turned anticlockwise, in units in which a push by an angle theta at radius a gives theta h(a).
 */
struct nav_surface_seen {
    double per_metre, per_radian;
};

struct nav_surface {
    double face;             /* probability of a face; the rest is a corner */
    double normal_rad;       /* direction into the face, robot frame; mean over the faces that explain what was seen */
    double normal_sigma_rad; /* pi/sqrt(3) and more: not known */
    double radius_mm;        /* of the corner */
    double radius_sigma_mm;
};

/* Estimates; never NAN. What is not finite or fits neither kind gives face 0.5 and the widest deviations. */
void nav_surface_of(const struct nav_surface_mount *, const struct nav_surface_seen *, struct nav_surface *);
/* cffi: end */

#endif
