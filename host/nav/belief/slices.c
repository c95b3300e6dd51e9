#include "slices.h"

#include <math.h>
#include <string.h>

#include "problem.h"

int nav_slice_carry(double *shift, double by, double cell, int most)
{
    double whole = floor((*shift + by) / cell + 0.5);
    *shift += by - whole * cell;
    return (int)fmax(fmin(whole, most), -most);
}

static double heading_of(const struct nav_slices *s, int p)
{
    return nav_slice_heading(p, s->cell_theta, s->rotation);
}

struct nav_pose nav_slices_centre(const struct nav_slices *s, size_t index)
{
    size_t pitch = (size_t)s->pitch, ny = (size_t)s->ny;
    int p = (int)(index / pitch / ny), j = (int)(index / pitch % ny), i = (int)(index % pitch);
    return (struct nav_pose){(i + 0.5) * s->cell + s->shift_x[p], (j + 0.5) * s->cell + s->shift_y[p],
                             nav_wrap(heading_of(s, p))};
}

/* Mass near a pose, and its offsets from that times mass. */
struct near {
    double mass, x, y, theta;
};

/* Adds the cells of slice p. */
static void add_near(const struct nav_slices *s, int p, struct nav_pose pose, struct near *sums)
{
    double x0 = 0.5 * s->cell + s->shift_x[p] - pose.x, y0 = 0.5 * s->cell + s->shift_y[p] - pose.y;
    double turn = nav_wrap(heading_of(s, p) - pose.theta);
    if (fabs(turn) > NAV_NEAR_RAD)
        return;
    int first_j = (int)fmax(ceil((-NAV_NEAR_M - y0) / s->cell), 0.0);
    int first_i = (int)fmax(ceil((-NAV_NEAR_M - x0) / s->cell), 0.0);
    const float *mass = s->mass + (size_t)p * (size_t)s->ny * (size_t)s->pitch;
    for (int j = first_j; j < s->ny && y0 + j * s->cell <= NAV_NEAR_M; j++) {
        const float *row = mass + (size_t)j * (size_t)s->pitch;
        double y = y0 + j * s->cell;
        for (int i = first_i; i < s->nx && x0 + i * s->cell <= NAV_NEAR_M; i++) {
            double x = x0 + i * s->cell, held = (double)row[i];
            if (x * x + y * y > NAV_NEAR_M * NAV_NEAR_M)
                continue;
            sums->mass += held;
            sums->x += held * x;
            sums->y += held * y;
            sums->theta += held * turn;
        }
    }
}

double nav_slices_near(const struct nav_slices *s, struct nav_pose pose, struct nav_pose *mean)
{
    struct near sums = {.mass = 0.0};
    for (int p = 0; p < s->nh; p++)
        add_near(s, p, pose, &sums);
    if (mean && sums.mass > 0.0)
        *mean = (struct nav_pose){pose.x + sums.x / sums.mass, pose.y + sums.y / sums.mass,
                                  nav_wrap(pose.theta + sums.theta / sums.mass)};
    return sums.mass;
}

double nav_slice_fan(struct nav_pose step, double cell_theta, double along_m)
{
    double distance = hypot(step.x, step.y);
    return cell_theta * cell_theta / 12.0 * distance * fmax(distance, along_m);
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

/* Adds one slice's moments about (x, y) to sums xx, xy, yy, xt, yt, tt, its heading being off by `turn`. */
static void add_moments(const double m[NAV_MOMENTS], double x, double y, double turn, double sums[6])
{
    double mx = m[1] - x * m[0], my = m[2] - y * m[0];
    sums[0] += m[3] - 2.0 * x * m[1] + x * x * m[0];
    sums[1] += m[4] - x * m[2] - y * m[1] + x * y * m[0];
    sums[2] += m[5] - 2.0 * y * m[2] + y * y * m[0];
    sums[3] += mx * turn;
    sums[4] += my * turn;
    sums[5] += m[0] * turn * turn;
}

void nav_slices_covariance(const struct nav_slices *s, struct nav_pose about, double covariance[9])
{
    double sums[6] = {0.0}, part[6];
    double within = s->cell * s->cell / 12.0, within_theta = s->cell_theta * s->cell_theta / 12.0;
    for (int p = 0; p < s->nh; p++)
        add_moments(s->moment[p], about.x - s->moment_x, about.y - s->moment_y,
                    nav_wrap(heading_of(s, p) - about.theta), sums);
    for (int k = 0; k < 6; k++)
        part[k] = sums[k] / s->total;
    double xx = fmax(part[0], 0.0) + within, yy = fmax(part[2], 0.0) + within;
    const double all[9] = {xx, part[1], part[3], part[1], yy, part[4], part[3], part[4], part[5] + within_theta};
    memcpy(covariance, all, sizeof all);
}

double nav_slices_summarise(const struct nav_slices *s, struct nav_pose mode, struct nav_gaussian *out)
{
    out->mean = mode;
    nav_slices_near(s, mode, &out->mean);
    nav_slices_covariance(s, out->mean, out->covariance);
    return nav_slices_near(s, out->mean, NULL);
}
