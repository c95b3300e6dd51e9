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

#include "contact_beam.h"

/* cffi: begin */
enum { NAV_CONTACT_STATES = 8, NAV_CONTACT_PARTS = 80 };

enum nav_contact_motion { NAV_CONTACT_BODY_WHISK, NAV_CONTACT_DRIVE_BY, NAV_CONTACT_SWEEP };

struct nav_contact_filter_config {
    double cone_m;                /* length of the cone, from the follicle's exit to its point */
    double kappa;                 /* stiffness of the plug in units of 3 E I0/cone */
    double creep, creep_s;        /* further tilt of the plug after a long time, share; its time constant */
    double noise_rad;             /* standard deviation of one sample's tilt */
    double largest_rad;           /* tilts beyond are saturated */
    double gain_sd;               /* of ln of the tilt over the model's */
    double model_share;           /* its random walk over the slope, per root of a radian */
    double friction, friction_sd; /* coefficient, 0 to 0.5 */
    double motion_share;          /* standard deviation of the reported motion of the base, share: of all; of a block */
    double ring_hz, ring_damping; /* slowest mode of the whisker in contact, damping ratio */
    double speed_sd;              /* of each component of a moving object's velocity, m/s */
    double speed_drift;           /* its random walk, m/s per root of a second */
    double moving;                /* probability, before anything is seen, that the object moves ... */
    double caught;                /* ... is a corner over which the shaft does not slide ... */
    double other;                 /* ... or that none of the hypotheses holds */
    double sample_s;              /* interval of samples */
    int block, report;            /* samples in an update; updates in a report */
};

/* One hypothesis. */
struct nav_contact_part {
    bool tip, corner, moving, slips;
    bool caught; /* the object goes along with the shaft */
    bool other;  /* none of these: the tilt alone is followed, and its rate over the base's way */
    double log_weight;
    double s[NAV_CONTACT_STATES];
    double p[NAV_CONTACT_STATES][NAV_CONTACT_STATES];
    double grip;  /* friction used, -1 to 1; positive: the contact slides towards the tip */
    double creep; /* rad */
};

struct nav_contact_filter {
    struct nav_contact_filter_config config;
    const struct nav_contact_beam *beam;
    struct nav_contact_part part[NAV_CONTACT_PARTS];
    int parts;
    double side;               /* +1 or -1: sign of the tilt on axis 0; 0: no contact yet */
    int filled, seen;          /* samples in the block; those read */
    double moved[3], ahead[3]; /* along, across (m), turned (rad): from middle to middle of blocks; since the middle */
    double tilt[2];            /* sum of those read in the block */
    double last[2];
    int equal, updates;
    double before, rate;            /* tilt of the last block, and its rate */
    double ring;                    /* square of the amplitude of ringing that may be left, rad^2 */
    double plane, plane_variance;   /* tilt of axis 1 over that of axis 0 */
    double turned_m, driven_m;      /* how far the base's turn and its drive have moved the contact */
    uint64_t bad, stuck, saturated; /* samples not read */
    uint64_t restarts;              /* contacts that none of the hypotheses explained */
};

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
    double other;                   /* probability that none of the hypotheses holds, as of a push along the whisker */
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

#endif
