/* The state of the contact filter: its parameters, its hypotheses, and a block of samples. */
#ifndef NAV_CONTACT_STATE_H
#define NAV_CONTACT_STATE_H

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
    bool hops;   /* the tip chatters over its surface: FRICTION is signed, the mean of a block */
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
    bool driven;               /* a motion of the base has come */
    double base[3], jumps;     /* the last; sum of its squared jumps in the block, (cones/s)^2 */
    double first[3];           /* as moved, of the block of the touch; ... */
    double changed[3];         /* ... how far the base has left this motion since, m, m, rad */
    double tilt[2];            /* sum of those read in the block */
    double last[2];
    int equal, updates;
    double before, rate;            /* tilt of the last block, and its rate */
    double ring;                    /* square of the amplitude of ringing that may be left, rad^2 */
    double plane, plane_variance;   /* tilt of axis 1 over that of axis 0 */
    double turned_m, driven_m;      /* how far the base's turn and its drive have moved the contact */
    double pushed_m;                /* how far of this along the whisker, towards its tip */
    uint64_t bad, stuck, saturated; /* samples not read */
    uint64_t restarts;              /* contacts that none of the hypotheses explained */
};
/* cffi: end */

/* A block, mirrored so that the tilt is positive: motion of the base (m), its turn (rad), duration, mean tilt (NAN: not
 * read) and the variance of its noise. */
struct nav_contact_step {
    double moved[2], turned, seconds, tilt, variance;
};

typedef double nav_contact_square[NAV_CONTACT_STATES][NAV_CONTACT_STATES];

#endif
