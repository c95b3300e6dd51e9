#include "grid_motion.h"

#include <math.h>
#include <string.h>

/* Of any row: 0.1 mm and 0.1 mrad keep the covariance regular. */
static const double LEAST = 1e-8;

enum { S = NAV_GRID_STATES, P = NAV_GRID_POSE, DISTANCE = NAV_GRID_DISTANCE_GAIN, TURN = NAV_GRID_TURN_GAIN };

void nav_grid_gaussian_begin(struct nav_grid_gaussian *g, const struct nav_grid_odometry *o)
{
    memset(g, 0, sizeof *g);
    g->cov[DISTANCE][DISTANCE] = o->relative * o->relative;
    g->cov[TURN][TURN] = o->turn > 0.0 ? 0.0 : o->relative * o->relative;
}

/* cov = jacobian cov jacobian' */
static void grid_transform(struct nav_grid_gaussian *g, double jacobian[S][S])
{
    double half[S][S];
    for (int r = 0; r < S; r++) {
        for (int c = 0; c < S; c++) {
            half[r][c] = 0.0;
            for (int k = 0; k < S; k++)
                half[r][c] += jacobian[r][k] * g->cov[k][c];
        }
    }
    for (int r = 0; r < S; r++) {
        for (int c = 0; c < S; c++) {
            g->cov[r][c] = 0.0;
            for (int k = 0; k < S; k++)
                g->cov[r][c] += half[r][k] * jacobian[c][k];
        }
    }
}

void nav_grid_gaussian_move(struct nav_grid_gaussian *g, const struct nav_grid_odometry *o, struct nav_pose step,
                            struct nav_noise lost)
{
    double *m = g->mean, distance = hypot(step.x, step.y), gain = 1.0 + m[DISTANCE], turn = 1.0 + m[TURN];
    double middle = m[NAV_GRID_HEADING] + 0.5 * turn * step.theta, c = cos(middle), s = sin(middle);
    /* The step lies in the frame it began in; its middle's direction is that of the path. */
    double half = -0.5 * step.theta, sx = cos(half) * step.x - sin(half) * step.y,
           sy = sin(half) * step.x + cos(half) * step.y;
    double dx = c * sx - s * sy, dy = s * sx + c * sy;
    double jacobian[S][S] = {{0.0}}, keep = o->memory_m > 0.0 ? exp(-distance / o->memory_m) : 0.0;
    double fresh = o->relative * o->relative * (1.0 - keep * keep);
    jacobian[NAV_GRID_X][NAV_GRID_X] = jacobian[NAV_GRID_Y][NAV_GRID_Y] = 1.0;
    jacobian[NAV_GRID_X][NAV_GRID_HEADING] = -gain * dy;
    jacobian[NAV_GRID_X][DISTANCE] = dx;
    jacobian[NAV_GRID_X][TURN] = -0.5 * step.theta * gain * dy;
    jacobian[NAV_GRID_Y][NAV_GRID_HEADING] = gain * dx;
    jacobian[NAV_GRID_Y][DISTANCE] = dy;
    jacobian[NAV_GRID_Y][TURN] = 0.5 * step.theta * gain * dx;
    jacobian[NAV_GRID_HEADING][NAV_GRID_HEADING] = 1.0;
    jacobian[NAV_GRID_HEADING][TURN] = step.theta;
    jacobian[DISTANCE][DISTANCE] = jacobian[TURN][TURN] = keep;
    double drift = o->turn > 0.0 ? o->turn * o->turn : o->drift * distance;
    grid_transform(g, jacobian);
    g->cov[NAV_GRID_X][NAV_GRID_X] += lost.position + LEAST;
    g->cov[NAV_GRID_Y][NAV_GRID_Y] += lost.position + LEAST;
    g->cov[NAV_GRID_HEADING][NAV_GRID_HEADING] += lost.heading + drift + LEAST;
    g->cov[DISTANCE][DISTANCE] += fresh;
    g->cov[TURN][TURN] += o->turn > 0.0 ? 0.0 : fresh;
    m[NAV_GRID_X] += gain * dx;
    m[NAV_GRID_Y] += gain * dy;
    m[NAV_GRID_HEADING] = nav_wrap(m[NAV_GRID_HEADING] + turn * step.theta);
    m[DISTANCE] *= keep;
    m[TURN] *= keep;
}

double nav_grid_gaussian_variance(const struct nav_grid_gaussian *g, const double slope[NAV_GRID_POSE], double noise)
{
    double sum = noise;
    for (int r = 0; r < P; r++) {
        for (int c = 0; c < P; c++)
            sum += slope[r] * slope[c] * g->cov[r][c];
    }
    return sum;
}

void nav_grid_gaussian_measure(struct nav_grid_gaussian *g, const double slope[NAV_GRID_POSE], double innovation,
                               double noise)
{
    double with[S], variance = nav_grid_gaussian_variance(g, slope, noise);
    for (int r = 0; r < S; r++) {
        with[r] = 0.0;
        for (int c = 0; c < P; c++)
            with[r] += slope[c] * g->cov[r][c];
    }
    for (int r = 0; r < S; r++) {
        g->mean[r] += with[r] / variance * innovation;
        for (int c = 0; c < S; c++)
            g->cov[r][c] -= with[r] * with[c] / variance;
    }
}

struct nav_grid_root nav_grid_gaussian_root(const struct nav_grid_gaussian *g)
{
    struct nav_grid_root root = {{{0.0}}};
    for (int r = 0; r < P; r++) {
        for (int c = 0; c <= r; c++) {
            double sum = g->cov[r][c];
            for (int k = 0; k < c; k++)
                sum -= root.at[r][k] * root.at[c][k];
            root.at[r][c] = r == c ? sqrt(fmax(sum, 0.1 * LEAST)) : sum / root.at[c][c];
        }
    }
    return root;
}

struct nav_pose nav_grid_gaussian_draw(const struct nav_grid_gaussian *g, const struct nav_grid_root *root,
                                       struct nav_rng *rng)
{
    double z[P], out[P];
    for (int r = 0; r < P; r++) {
        z[r] = nav_rng_normal(rng);
        out[r] = g->mean[r];
        for (int c = 0; c <= r; c++)
            out[r] += root->at[r][c] * z[c];
    }
    return (struct nav_pose){out[0], out[1], nav_wrap(out[2])};
}

/* root z = pose - mean */
static void grid_whiten(const struct nav_grid_gaussian *g, const struct nav_grid_root *root, struct nav_pose pose,
                        double z[P])
{
    double off[P] = {pose.x - g->mean[0], pose.y - g->mean[1], nav_wrap(pose.theta - g->mean[2])};
    for (int r = 0; r < P; r++) {
        z[r] = off[r];
        for (int c = 0; c < r; c++)
            z[r] -= root->at[r][c] * z[c];
        z[r] /= root->at[r][r];
    }
}

double nav_grid_gaussian_density(const struct nav_grid_gaussian *g, const struct nav_grid_root *root,
                                 struct nav_pose pose)
{
    double z[P], sum = 0.0;
    grid_whiten(g, root, pose, z);
    for (int r = 0; r < P; r++)
        sum -= 0.5 * z[r] * z[r] + log(root->at[r][r]);
    return sum;
}

void nav_grid_gaussian_set(struct nav_grid_gaussian *g, struct nav_pose pose)
{
    struct nav_grid_root root = nav_grid_gaussian_root(g);
    double z[P], with[S][P];
    grid_whiten(g, &root, pose, z);
    for (int r = P; r < S; r++) { /* with = cov[gains][pose] / root' */
        for (int c = 0; c < P; c++) {
            with[r][c] = g->cov[r][c];
            for (int k = 0; k < c; k++)
                with[r][c] -= with[r][k] * root.at[c][k];
            with[r][c] /= root.at[c][c];
        }
    }
    for (int r = P; r < S; r++) {
        for (int k = 0; k < P; k++)
            g->mean[r] += with[r][k] * z[k];
        for (int c = P; c < S; c++) {
            for (int k = 0; k < P; k++)
                g->cov[r][c] -= with[r][k] * with[c][k];
        }
    }
    for (int r = 0; r < S; r++) {
        for (int c = 0; c < P; c++)
            g->cov[r][c] = g->cov[c][r] = 0.0;
    }
    g->mean[0] = pose.x;
    g->mean[1] = pose.y;
    g->mean[2] = pose.theta;
}
