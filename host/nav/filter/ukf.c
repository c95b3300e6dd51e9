/* Unscented Kalman filter (Julier and Uhlmann): moments of a sighting over six points on the belief's sqrt(3) contour.
 *
 * With n = 3 and kappa = 0 the centre has no weight and all others 1/6: fourth moments fit a Gaussian, and no weight is
 * negative. Motion is moved as by the extended filter, to first order; see ekf.c for what is read. */
#include <math.h>

#include "kalman.h"

enum { POINTS = 6 };

/* Offset number n: plus and minus sqrt(3) times the columns of the covariance's Cholesky factor. */
static void offset(const struct nav_gaussian *g, int n, double d[3])
{
    const double *p = g->covariance;
    double l00 = sqrt(fmax(p[0], 0.0)), l10 = l00 > 0.0 ? p[3] / l00 : 0.0, l20 = l00 > 0.0 ? p[6] / l00 : 0.0;
    double l11 = sqrt(fmax(p[4] - l10 * l10, 0.0)), l21 = l11 > 0.0 ? (p[7] - l20 * l10) / l11 : 0.0;
    double l22 = sqrt(fmax(p[8] - l20 * l20 - l21 * l21, 0.0));
    const double column[3][3] = {{l00, l10, l20}, {0.0, l11, l21}, {0.0, 0.0, l22}};
    double scale = n % 2 ? -sqrt(3.0) : sqrt(3.0);
    for (int a = 0; a < 3; a++)
        d[a] = scale * column[n / 2][a];
}

static bool linearise(struct nav_kalman *k, const struct nav_sighting *s, struct nav_linear *out)
{
    double d[POINTS][3], value[POINTS];
    *out = (struct nav_linear){.expected = 0.0};
    for (int n = 0; n < POINTS; n++) {
        offset(&k->belief, n, d[n]);
        const struct nav_pose *mean = &k->belief.mean;
        value[n] =
            nav_kalman_expect(k, s, (struct nav_pose){mean->x + d[n][0], mean->y + d[n][1], mean->theta + d[n][2]});
        if (!isfinite(value[n]))
            value[n] = s->reach; /* nothing within reach is at least that far */
        out->expected += value[n] / POINTS;
    }
    for (int n = 0; n < POINTS; n++) {
        double off = value[n] - out->expected;
        out->variance += off * off / POINTS;
        for (int a = 0; a < 3; a++)
            out->cross[a] += d[n][a] * off / POINTS;
    }
    return isfinite(out->expected) && isfinite(out->variance);
}

static void *create(const struct nav_problem *problem)
{
    return nav_kalman_new(problem, linearise);
}

const struct nav_filter_ops nav_ukf_filter = {.name = "ukf", .create = create, NAV_KALMAN_OPS};
