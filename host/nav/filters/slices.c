#include "slices.h"

#include <math.h>
#include <string.h>

#include "filter.h"

int nav_slice_carry(double *shift, double by, double cell, int most)
{
    double whole = floor((*shift + by) / cell + 0.5);
    *shift += by - whole * cell;
    return (int)fmax(fmin(whole, most), -most);
}

void nav_slice_near(const struct nav_slice *s, struct nav_pose pose, struct nav_near *sums)
{
    double x0 = s->x - pose.x, y0 = s->y - pose.y, turn = nav_wrap(s->heading - pose.theta);
    if (fabs(turn) > NAV_NEAR_RAD)
        return;
    int first_j = (int)fmax(ceil((-NAV_NEAR_M - y0) / s->cell), 0.0);
    int first_i = (int)fmax(ceil((-NAV_NEAR_M - x0) / s->cell), 0.0);
    for (int j = first_j; j < s->ny && y0 + j * s->cell <= NAV_NEAR_M; j++) {
        const float *row = s->mass + (size_t)j * (size_t)s->pitch;
        double y = y0 + j * s->cell;
        for (int i = first_i; i < s->nx && x0 + i * s->cell <= NAV_NEAR_M; i++) {
            double x = x0 + i * s->cell, mass = (double)row[i];
            if (x * x + y * y > NAV_NEAR_M * NAV_NEAR_M)
                continue;
            sums->mass += mass;
            sums->x += mass * x;
            sums->y += mass * y;
            sums->theta += mass * turn;
        }
    }
}

struct nav_pose nav_near_mean(const struct nav_near *sums, struct nav_pose pose)
{
    return (struct nav_pose){pose.x + sums->x / sums->mass, pose.y + sums->y / sums->mass,
                             nav_wrap(pose.theta + sums->theta / sums->mass)};
}

void nav_slice_coordinates(double first, double step, int count, float *out)
{
    for (int i = 0; i < count; i++)
        out[i] = (float)(first + i * step);
}

void nav_slice_moments(const struct nav_row_sums *sums, double moments[NAV_MOMENTS])
{
    for (int k = 0; k < NAV_MOMENTS; k++) {
        moments[k] = 0.0;
        for (int n = 0; n < NAV_LANES; n++)
            moments[k] += (double)sums->moment[k][n];
    }
}

void nav_slice_add(const double m[NAV_MOMENTS], double x, double y, double turn, double sums[6])
{
    double mx = m[1] - x * m[0], my = m[2] - y * m[0];
    sums[0] += m[3] - 2.0 * x * m[1] + x * x * m[0];
    sums[1] += m[4] - x * m[2] - y * m[1] + x * y * m[0];
    sums[2] += m[5] - 2.0 * y * m[2] + y * y * m[0];
    sums[3] += mx * turn;
    sums[4] += my * turn;
    sums[5] += m[0] * turn * turn;
}

void nav_slice_covariance(const double sums[6], double total, double cell, double cell_theta, double covariance[9])
{
    double part[6], within = cell * cell / 12.0, within_theta = cell_theta * cell_theta / 12.0;
    for (int k = 0; k < 6; k++)
        part[k] = sums[k] / total;
    double xx = fmax(part[0], 0.0) + within, yy = fmax(part[2], 0.0) + within;
    const double all[9] = {xx, part[1], part[3], part[1], yy, part[4], part[3], part[4], part[5] + within_theta};
    memcpy(covariance, all, sizeof all);
}
