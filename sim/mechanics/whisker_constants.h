/* What is known and what is assumed about whiskers and their sensors, SI units unless the name says otherwise.
 *
 * Where a number comes from: [P] stated in the CrunchBot paper (Fox et al., TAROS 2011); [D] derived from it;
 * [L] literature; [A] assumption.
 */
#ifndef SIM_WHISKER_CONSTANTS_H
#define SIM_WHISKER_CONSTANTS_H

#include "sim_angle.h"

#define SIM_TICK_S 500e-6 /* [P] 2 kHz */

/* Geometry and material. */
#define SIM_WHISKER_TOTAL_M 0.160         /* [P] */
#define SIM_WHISKER_OUTSIDE_M 0.140       /* [P] outside the follicle */
#define SIM_WHISKER_BASE_DIAMETER 1.45e-3 /* [P] */
#define SIM_WHISKER_TIP_DIAMETER 0.30e-3  /* [P] linear taper */
#define SIM_WHISKER_TAPER ((SIM_WHISKER_BASE_DIAMETER - SIM_WHISKER_TIP_DIAMETER) / SIM_WHISKER_TOTAL_M) /* [D] */
#define SIM_WHISKER_EXIT_DIAMETER                                                                                      \
    (SIM_WHISKER_BASE_DIAMETER - SIM_WHISKER_TAPER * (SIM_WHISKER_TOTAL_M - SIM_WHISKER_OUTSIDE_M)) /* [D] */
#define SIM_WHISKER_CONE_M                                                                                             \
    (SIM_WHISKER_EXIT_DIAMETER / SIM_WHISKER_TAPER) /* [D] Lc: from the exit to the cone's point */
#define SIM_WHISKER_I0                                                                                                 \
    (SIM_PI * SIM_WHISKER_EXIT_DIAMETER * SIM_WHISKER_EXIT_DIAMETER * SIM_WHISKER_EXIT_DIAMETER *                      \
     SIM_WHISKER_EXIT_DIAMETER / 64) /* [D] second moment at the exit */
#define SIM_WHISKER_DENSITY 1200.0   /* [A] kg/m^3 */
#define SIM_WHISKER_E 2.5e9          /* [A] printed resin; scales forces only, never the angle of the field */

/* Plug, magnet and sensor. */
#define SIM_PLUG_KAPPA 1.0              /* [A] k Lc / (3 E I0): plug as stiff as the whisker */
#define SIM_PLUG_STOP (15 * SIM_DEGREE) /* [A] */
#define SIM_MAGNET_PIVOT_M 3e-3         /* [A] from the plug's pivot down to the magnet's centre */
#define SIM_MAGNET_GAP_M 2e-3    /* [A] from there down to the sensor: the paper's 0.75 mm, half a magnet, the chip */
#define SIM_FIELD_GAIN 2.75      /* [D] field angle per tilt: magnet 3 mm under the pivot, sensor 2 mm below it */
#define SIM_FIELD_NOISE_DEG 0.03 /* [A] white, per axis and sample */
#define SIM_FIELD_DRIFT_DEG 0.05 /* [A] slow drift stays within it ... */
#define SIM_FIELD_DRIFT_MIN_S 120.0 /* [A] ... and takes minutes */
#define SIM_FIELD_DRIFT_MAX_S 300.0 /* [A] */

/* Whisk repeatability of object whiskers 1 to 4: relative spread of the amplitude from contact to contact [D], chosen
 * to give the paper's standard errors of radial distance. A fifth whisker is like the first, and so on. */
#define SIM_WHISK_SPREADS                                                                                              \
    {                                                                                                                  \
        0.082, 0.040, 0.026, 0.063                                                                                     \
    }

#define SIM_TURN_LAG_S 0.05 /* [A] a base's rate of turn follows its command with this lag, for its whiskers' swing */

#define SIM_TIP_JITTER 0.10 /* [A] of the length of a weave's period */

#endif
