/* What one whisker is made of, and what is not known about it. SI units; angles in rad.
 *
 * Beam coordinate s from the follicle's exit, 0..length; diameter d(s) = d0 (1 - s/cone), so that the second moment is
 * I(s) = I0 (1 - s/cone)^4. The base is held by a plug of rotational stiffness k = kappa 3 E I0/cone.
 */
#ifndef MECH_WHISKER_H
#define MECH_WHISKER_H

#include <stddef.h>
#include <stdint.h>

/* cffi: begin */
/* Parameters; mech_whisker_default() is the CrunchBot's whisker with mid-range unknowns. */
struct mech_whisker {
    double length;        /* outside the follicle, m, below cone */
    double exit_diameter; /* m */
    double cone;          /* from the exit to the point where the cone would end, m */
    double young;         /* Pa */
    double density;       /* kg/m^3 */
    double kappa;         /* plug stiffness in units of 3 E I0/cone; infinity: clamped */
    double damping;       /* damping ratio of every mode */
    double friction;      /* Coulomb, at an edge */
    double creep;         /* extra tilt of the plug after a long time, share of the elastic one */
    double creep_s;       /* its time constant */
    double stop;          /* largest tilt of the plug */
    double pivot;         /* from the plug's pivot down to the magnet's centre, m */
    double gap;           /* from the magnet's centre down to the sensor, m */
    double gain;          /* factor on the field angle: 1 but for the spread between sensors */
};

/* Levels of detail of whatever bends a whisker: a static law, closed form or large deflection, MECH_VIBRATION added or
 * not. */
enum { MECH_CLOSED = 0, MECH_LARGE = 1, MECH_VIBRATION = 2 };

/* A parameter that no source fixes: what is assumed and between which values a study should vary it. */
struct mech_unknown {
    const char *name;
    double typical, low, high;
};

struct mech_whisker mech_whisker_default(void);

/* A whisker of a batch: kappa, damping, friction, creep and gain drawn within their ranges (uniform; gain normal with
 * half its range as deviation), the rest typical. Equal seed and number: equal whisker. */
struct mech_whisker mech_whisker_draw(uint64_t seed, uint32_t number);

/* The list of unknowns, count of them in *count. */
const struct mech_unknown *mech_unknowns(size_t *count);

double mech_whisker_bending(const struct mech_whisker *whisker);       /* E I0, N m^2 */
double mech_whisker_compliance(const struct mech_whisker *whisker);    /* of the plug, 1/k, rad/(N m); 0 if clamped */
double mech_whisker_tip_stiffness(const struct mech_whisker *whisker); /* against a normal force at the tip, N/m */
double mech_whisker_field(const struct mech_whisker *whisker, double tilt); /* field angle of a tilt, same sign */

/* Small deflections, closed form: the conical-beam model of Birdwell et al. 2007 (J Neurophysiol 98:2439), plug in
 * series. A fixed point at radial distance a from the follicle's exit pushes the whisker by the angle theta. 0 < a <
 * cone. */

/* Base moment, N m: theta / (1/k + a cone/(3 E I0 (cone - a))). */
double mech_whisker_moment(const struct mech_whisker *whisker, double a, double theta);

/* Tilt of the plug: theta (1 - x)/(1 - x + kappa x), x = a/cone; not held at the stop. 0 for a clamped whisker. */
double mech_whisker_tilt(const struct mech_whisker *whisker, double a, double theta);

/* Stiffness against a normal force at a, base clamped, N/m: 3 E I0 (1 - a/cone)/a^3. */
double mech_whisker_stiffness(const struct mech_whisker *whisker, double a);

/* Field angles of a tilt in two planes at once: the magnet turns in the plane of the two. */
void mech_whisker_fields(const struct mech_whisker *whisker, const double tilt[2], double field[2]);

/* Returns the same whisker with another diameter at the tip; the exit's is kept. */
struct mech_whisker mech_whisker_with_tip(struct mech_whisker whisker, double tip_diameter);
/* cffi: end */

/* A tilt, held at the plug's stop. */
static inline double mech_whisker_stopped(const struct mech_whisker *whisker, double tilt)
{
    return tilt > whisker->stop ? whisker->stop : tilt < -whisker->stop ? -whisker->stop : tilt;
}

#endif
