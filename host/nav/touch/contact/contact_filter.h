/* What a whisker touches, followed through a contact: place, normal, friction, and whether the object moves.
 *
 * A bank of extended Kalman filters whose weights are the probabilities of their hypotheses: the object stands still or
 * moves at an unknown velocity; it is a corner under the shaft, a rounded surface under the shaft, or a surface under
 * the tip. A hypothesis' state is two coordinates of the bent whisker (contact_beam.h), the object's radius or
 * curvature, its velocity, the gain of the sensor, the coefficient of friction and the error of the base's motion.
 * Prediction is geometry: the object's material moves with its velocity less the base's, and the contact follows along
 * the whisker and the surface, sticking while the force lies inside the friction cone and sliding on its edge
 * otherwise. What is measured is the tilt of the plug, which is the moment over the plug's stiffness. An object that
 * the whisker has let go of is followed on: the slope at the contact is then negative, and nothing is bent.
 *
 * Frame of the whisker: origin at the follicle's exit, x along the unbent whisker, y the direction of positive tilt of
 * axis 0; it turns and moves with the base. Plane geometry; the second axis gives the angle of the bending's plane.
 */
#ifndef NAV_CONTACT_FILTER_H
#define NAV_CONTACT_FILTER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "contact_state.h"

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

/* cffi: begin */
/* What is known of the middle of the last block; lengths m, whisker's frame. */
struct nav_contact_answer {
    double point[2], point_cov[2][2];
    double arc_m, arc_sd_m;       /* along the shaft */
    double plane_rad, plane_sd;   /* angle of the bending's plane about the whisker */
    double normal_rad, normal_sd; /* direction of the surface's outward normal; of a corner, of the whisker's */
    double velocity[2], velocity_cov[2][2]; /* of the object */
    double speed, speed_sd;                 /* if it moves */
    double sweep, corner, tip, slip;        /* probabilities: it moves; its radius is below 5 mm; at the tip; slides */
    double friction, friction_sd;
    double curvature, curvature_sd; /* of the surface, 1/m, a corner's counted as 0 */
    double other;                   /* probability that none of the hypotheses holds */
    double along;                   /* share of the way since the touch that pushes along the whisker, 0 to 1 */
    double changed_m;               /* way by which the base has left the motion that it had at the touch */
    int motion;                     /* enum nav_contact_motion */
    int parts;                      /* hypotheses left; 0: no contact yet, and nothing above is known */
};

/* The beam must outlive the filter. */
void nav_contact_filter_init(struct nav_contact_filter *, const struct nav_contact_filter_config *,
                             const struct nav_contact_beam *);

/* Forgets the contact; counts stay. */
void nav_contact_filter_begin(struct nav_contact_filter *);

/* Takes a sample of a contact. base: velocity of the follicle's exit along x and y (m/s) and its rate of turn (rad/s);
 * tilt: of both axes about the rest, rad. A sample not good, not finite, saturated or equal to many before is counted
 * and taken as not read; a base that is not finite as standing still. true: a report is due. */
bool nav_contact_filter_update(struct nav_contact_filter *, const double base[3], const double tilt[2], bool good);

void nav_contact_filter_answer(const struct nav_contact_filter *, struct nav_contact_answer *);

/* Takes bases [n][3], tilts [n][2], good [n]; writes at most `most` reports and the sample each is of. Returns their
 * number. */
size_t nav_contact_filter_run(struct nav_contact_filter *, const double *bases, const double *tilts,
                              const uint8_t *good, size_t n, struct nav_contact_answer *reports, double *middles,
                              size_t most);
/* cffi: end */

#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif
