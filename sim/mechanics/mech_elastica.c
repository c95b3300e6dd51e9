#include "mech_elastica.h"

#include <math.h>

#include "whisker_constants.h"

#define LARGEST_SLOPE 2.65 /* rad: beyond every fold from 0.1 cones on */
#define SLOPE_STEP 0.05

/* Tangent angle and position, seen from the contact: angle 0 and origin there. */
struct point {
    double angle, x, y;
};

/* Derivative along q = -log(1 - s), which spreads steps by the local diameter: ds = (1 - s) dq. The force on the beam
 * at the origin is force (nu, 1). */
static struct point derivative(struct point at, double left, double force, double nu)
{
    double moment = force * (nu * at.y - at.x);
    return (struct point){moment / (left * left * left), left * cos(at.angle), left * sin(at.angle)};
}

static struct point add(struct point a, struct point b, double scale)
{
    return (struct point){a.angle + scale * b.angle, a.x + scale * b.x, a.y + scale * b.y};
}

struct mech_bend mech_elastica_bend(double arc, double force, double nu, int steps)
{
    struct point at = {0, 0, 0};
    double h = log(1 - arc) / steps; /* negative: from the contact to the base */
    double left = 1 - arc, half = exp(-h / 2);
    for (int i = 0; i < steps; i++) {
        struct point k1 = derivative(at, left, force, nu);
        struct point k2 = derivative(add(at, k1, h / 2), left * half, force, nu);
        struct point k3 = derivative(add(at, k2, h / 2), left * half, force, nu);
        left *= half * half;
        struct point k4 = derivative(add(at, k3, h), left, force, nu);
        at = add(add(add(add(at, k1, h / 6), k2, h / 3), k3, h / 3), k4, h / 6);
    }
    /* Seen from the base: turned by the slope. */
    double slope = -at.angle, c = cos(slope), s = sin(slope);
    double px = -c * at.x + s * at.y, py = -s * at.x - c * at.y;
    return (struct mech_bend){hypot(px, py), atan2(py, px), slope, force * (nu * at.y - at.x), force, arc};
}

/* Small deflections: slope at the contact per force. */
static double softness(double arc)
{
    double left = 1 - arc;
    return -0.5 + left / 3 + 1 / (6 * left * left);
}

bool mech_elastica_at_slope(double x, double slope, double nu, int steps, const struct mech_bend *from,
                            struct mech_bend *bend)
{
    double arc = from && from->arc > 0 ? from->arc : x;
    double force = from && from->arc > 0 ? from->force : slope / softness(x);
    for (int i = 0; i < 40; i++) {
        *bend = mech_elastica_bend(arc, force, nu, steps);
        double ex = x - bend->x, es = slope - bend->slope;
        if (fabs(ex) < 1e-11 && fabs(es) < 1e-11)
            return true;
        double da = 1e-6 * (1 - arc), df = 1e-6 * force;
        struct mech_bend a = mech_elastica_bend(arc + da, force, nu, steps);
        struct mech_bend f = mech_elastica_bend(arc, force + df, nu, steps);
        double xa = (a.x - bend->x) / da, sa = (a.slope - bend->slope) / da;
        double xf = (f.x - bend->x) / df, sf = (f.slope - bend->slope) / df;
        double det = xa * sf - xf * sa;
        double move_arc = (ex * sf - xf * es) / det, move_force = (xa * es - sa * ex) / det;
        double most = fmax(fabs(move_arc) / (0.3 * (1 - arc)), fabs(move_force) / (0.5 * force));
        double scale = most > 1 ? 1 / most : 1;
        if (!isfinite(most))
            return false;
        arc += scale * move_arc;
        force += scale * move_force;
    }
    return false;
}

bool mech_elastica_at_angle(double x, double theta, double nu, int steps, struct mech_bend *bend)
{
    struct mech_bend low = {.arc = 0}, high;
    for (double slope = SLOPE_STEP;; slope += SLOPE_STEP) {
        if (slope > LARGEST_SLOPE || !mech_elastica_at_slope(x, slope, nu, steps, &low, &high) ||
            high.theta < low.theta)
            return false;
        if (high.theta >= theta)
            break;
        low = high;
    }
    for (int i = 0; i < 60; i++) { /* bisection: theta grows with the slope in between */
        double slope = (low.slope + high.slope) / 2;
        if (!mech_elastica_at_slope(x, slope, nu, steps, &high, bend))
            return false;
        if (fabs(bend->theta - theta) < 1e-12)
            return true;
        *(bend->theta < theta ? &low : &high) = *bend;
    }
    return true;
}
