/* Extended Kalman filter: sightings are linearised about the mean by central differences.
 *
 * Ranges have a derivative except at corners; textures have none, and only the borders they reveal are used (see
 * borders.h), as landmark filters do with lines. Data association is the nearest border or surface within a gate. */
#include <math.h>

#include "kalman.h"

static struct nav_pose shifted(struct nav_pose pose, int axis, double by)
{
    double *coordinate = axis == 0 ? &pose.x : axis == 1 ? &pose.y : &pose.theta;
    *coordinate += by;
    return pose;
}

/* Derivative along one axis; NAN at a corner or an edge, where the range jumps between the two points. */
static double slope_along(struct nav_kalman *k, const struct nav_sighting *s, int axis)
{
    static const double STEP = 1e-4, STEEPEST = 50.0; /* m and rad; m per m or rad */
    double slope = (nav_kalman_expect(k, s, shifted(k->belief.mean, axis, STEP)) -
                    nav_kalman_expect(k, s, shifted(k->belief.mean, axis, -STEP))) /
                   (2.0 * STEP);
    return fabs(slope) <= STEEPEST ? slope : (double)NAN;
}

static bool linearise(struct nav_kalman *k, const struct nav_sighting *s, struct nav_linear *out)
{
    const double *p = k->belief.covariance;
    double slope[3];
    out->expected = nav_kalman_expect(k, s, k->belief.mean);
    for (int a = 0; a < 3; a++)
        slope[a] = slope_along(k, s, a);
    out->variance = 0.0;
    for (int a = 0; a < 3; a++) {
        out->cross[a] = p[3 * a] * slope[0] + p[3 * a + 1] * slope[1] + p[3 * a + 2] * slope[2];
        out->variance += slope[a] * out->cross[a];
    }
    return isfinite(out->expected) && isfinite(out->variance);
}

static void *create(const struct nav_problem *problem)
{
    return nav_kalman_new(problem, linearise);
}

const struct nav_filter_ops nav_ekf_filter = {.name = "ekf", .create = create, NAV_KALMAN_OPS};
