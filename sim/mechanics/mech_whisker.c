#include "mech_whisker.h"

#include <math.h>

#include "sim_rng.h"
#include "whisker_constants.h"

/* Ranges are those of the sources quoted in whisker_constants.h; every one is an assumption, none is measured. */
enum { YOUNG, DENSITY, KAPPA, DAMPING, FRICTION, CREEP, CREEP_S, STOP, GAIN, UNKNOWNS };

static const struct mech_unknown LIST[UNKNOWNS] = {
    [YOUNG] = {"young", SIM_WHISKER_E, 1.5e9, 6e9},
    [DENSITY] = {"density", SIM_WHISKER_DENSITY, 1100, 1600},
    [KAPPA] = {"kappa", SIM_PLUG_KAPPA, 0.7, 1.3},
    [DAMPING] = {"damping", 0.10, 0.05, 0.15},
    [FRICTION] = {"friction", 0.30, 0.20, 0.40},
    [CREEP] = {"creep", 0.075, 0.05, 0.10},
    [CREEP_S] = {"creep_s", 0.5, 0.25, 1.0},
    [STOP] = {"stop", SIM_PLUG_STOP, 10 * SIM_DEGREE, 20 * SIM_DEGREE},
    [GAIN] = {"gain", 1.0, 0.95, 1.05},
};

#define SMALL_TILT 0.03 /* rad: below it the series of mech_whisker_dipole_ratio() is good to 0.01 % */

enum { FOR_BATCH = 0x6d656368 }; /* purpose of the batch's stream of random numbers */

const struct mech_unknown *mech_unknowns(size_t *count)
{
    *count = UNKNOWNS;
    return LIST;
}

struct mech_whisker mech_whisker_default(void)
{
    return (struct mech_whisker){
        .length = SIM_WHISKER_OUTSIDE_M,
        .exit_diameter = SIM_WHISKER_EXIT_DIAMETER,
        .cone = SIM_WHISKER_CONE_M,
        .young = LIST[YOUNG].typical,
        .density = LIST[DENSITY].typical,
        .kappa = LIST[KAPPA].typical,
        .damping = LIST[DAMPING].typical,
        .friction = LIST[FRICTION].typical,
        .creep = LIST[CREEP].typical,
        .creep_s = LIST[CREEP_S].typical,
        .stop = LIST[STOP].typical,
        .pivot = SIM_MAGNET_PIVOT_M,
        .gap = SIM_MAGNET_GAP_M,
        .gain = LIST[GAIN].typical,
    };
}

static double mech_whisker_uniform(struct sim_rng *rng, const struct mech_unknown *unknown)
{
    return unknown->low + (unknown->high - unknown->low) * sim_rng_uniform(rng);
}

struct mech_whisker mech_whisker_draw(uint64_t seed, uint32_t number)
{
    struct sim_rng rng = sim_rng_stream(seed, FOR_BATCH, number);
    struct mech_whisker whisker = mech_whisker_default();
    whisker.kappa = mech_whisker_uniform(&rng, &LIST[KAPPA]);
    whisker.damping = mech_whisker_uniform(&rng, &LIST[DAMPING]);
    whisker.friction = mech_whisker_uniform(&rng, &LIST[FRICTION]);
    whisker.creep = mech_whisker_uniform(&rng, &LIST[CREEP]);
    double half_range = (LIST[GAIN].high - LIST[GAIN].low) / 2;
    whisker.gain = LIST[GAIN].typical + 0.5 * half_range * sim_rng_normal(&rng);
    return whisker;
}

double mech_whisker_bending(const struct mech_whisker *whisker)
{
    double d2 = whisker->exit_diameter * whisker->exit_diameter;
    return whisker->young * SIM_PI * d2 * d2 / 64;
}

double mech_whisker_compliance(const struct mech_whisker *whisker)
{
    return whisker->cone / (3 * mech_whisker_bending(whisker) * whisker->kappa);
}

double mech_whisker_tip_stiffness(const struct mech_whisker *whisker)
{
    double a = whisker->length;
    return 1 / (1 / mech_whisker_stiffness(whisker, a) + a * a * mech_whisker_compliance(whisker));
}

double mech_whisker_moment(const struct mech_whisker *whisker, double a, double theta)
{
    double bending = a * whisker->cone / (3 * mech_whisker_bending(whisker) * (whisker->cone - a));
    return theta / (mech_whisker_compliance(whisker) + bending);
}

double mech_whisker_tilt(const struct mech_whisker *whisker, double a, double theta)
{
    return mech_whisker_compliance(whisker) * mech_whisker_moment(whisker, a, theta);
}

double mech_whisker_stiffness(const struct mech_whisker *whisker, double a)
{
    return 3 * mech_whisker_bending(whisker) * (1 - a / whisker->cone) / (a * a * a);
}

/* Field angle of a dipole that hangs `pivot` below its pivot and turns with it, seen `gap` below the magnet's rest
 * (Jackson, Classical Electrodynamics, eq. 5.56, in the plane); about -tilt (1 + 3 pivot/gap)/2 for a small tilt. The
 * sign is dropped: which way the chip counts is a matter of mounting. */
static double mech_whisker_dipole_angle(const struct mech_whisker *whisker, double tilt)
{
    double s = sin(tilt), c = cos(tilt);
    double rx = -whisker->pivot * s, ry = whisker->pivot * c - (whisker->pivot + whisker->gap);
    double along = (s * rx - c * ry) / (rx * rx + ry * ry); /* m.r/r^2 with m = (s, -c) */
    double bx = 3 * along * rx - s, by = 3 * along * ry + c;
    return -atan2(bx, -by);
}

double mech_whisker_field(const struct mech_whisker *whisker, double tilt)
{
    return whisker->gain * mech_whisker_dipole_angle(whisker, tilt);
}

/* mech_whisker_dipole_angle() per tilt, of a tilt whose square is small: its series to the third order. */
static double mech_whisker_dipole_ratio(const struct mech_whisker *whisker, double square)
{
    double q = whisker->pivot / whisker->gap, first = (1 + 3 * q) / 2;
    double bent = (1 + q) * (1 + 2 * q) / 2, across = 3 * bent - 1.5 * q - 0.5, along = q / 2 + 3 * q * bent + 1.0 / 6;
    double third = first * (across / 2 - along / (2 * first)) - first * first * first / 3;
    return whisker->gain * (first + third * square);
}

void mech_whisker_fields(const struct mech_whisker *whisker, const double tilt[2], double field[2])
{
    double square = tilt[0] * tilt[0] + tilt[1] * tilt[1], ratio = 0; /* at rest: most whiskers, most of the time */
    if (square > 0 && square < SMALL_TILT * SMALL_TILT) {
        ratio = mech_whisker_dipole_ratio(whisker, square);
    } else if (square > 0) {
        double whole = sqrt(square);
        ratio = mech_whisker_field(whisker, whole) / whole;
    }
    field[0] = ratio * tilt[0];
    field[1] = ratio * tilt[1];
}

struct mech_whisker mech_whisker_with_tip(struct mech_whisker whisker, double tip_diameter)
{
    whisker.cone = whisker.length / (1 - tip_diameter / whisker.exit_diameter);
    return whisker;
}
