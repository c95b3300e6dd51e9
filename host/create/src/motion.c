#include "create/motion.h"

#include <math.h>

#define UNIFORM_VARIANCE (1.0 / 12) /* of a number known to a unit */
#define SMALL_ANGLE 1e-4            /* rad; below it the series' error is less than a double's */

/* Chord of an arc over its length, and its derivative by the angle. */
static double motion_chord_ratio(double angle)
{
    const double half = angle / 2;
    return fabs(half) < SMALL_ANGLE ? 1 - half * half / 6 : sin(half) / half;
}

static double motion_chord_slope(double angle)
{
    const double half = angle / 2;
    return fabs(half) < SMALL_ANGLE ? -half / 6 : (cos(half) - sin(half) / half) / (2 * half);
}

/* The pose's derivatives by distance and by angle of the step at its end. */
struct derivatives {
    double by_distance[3], by_angle[3];
};

static struct derivatives motion_derive(double heading, const struct create_step *step)
{
    const double direction = heading + step->angle / 2, chord = motion_chord_ratio(step->angle);
    const double slope = step->distance * motion_chord_slope(step->angle), half = step->distance * chord / 2;
    return (struct derivatives){
        {chord * cos(direction), chord * sin(direction), 0},
        {slope * cos(direction) - half * sin(direction), slope * sin(direction) + half * cos(direction), 1},
    };
}

/* What a heading error before the step does to the position after it: rows x and y of the columns given. */
static void motion_carry(double (*rows)[3], double dx, double dy)
{
    for (int k = 0; k < 3; k++) {
        rows[0][k] -= dy * rows[2][k];
        rows[1][k] += dx * rows[2][k];
    }
}

/* F P F', with F = [1 0 -dy; 0 1 dx; 0 0 1]. */
static void motion_carry_covariance(double p[3][3], double dx, double dy)
{
    motion_carry(p, dx, dy);
    for (int k = 0; k < 3; k++) {
        p[k][0] -= dy * p[k][2];
        p[k][1] += dx * p[k][2];
    }
}

/* P += variance g g'. */
static void motion_add_outer(double p[3][3], const double g[3], double variance)
{
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            p[i][j] += variance * g[i] * g[j];
        }
    }
}

static void motion_add_errors(struct create_motion *motion, const struct create_step *step,
                              const struct derivatives *by)
{
    for (int i = 0; i < 3; i++) {
        motion->scale[i][0] += by->by_distance[i] * copysign(step->scale_distance, step->distance);
        motion->scale[i][1] += by->by_angle[i] * copysign(step->scale_angle, step->angle);
        motion->scale[i][2] += by->by_angle[i] * copysign(step->scale_drift, step->distance);
    }
    motion_add_outer(motion->loose, by->by_distance, step->loose_distance * step->loose_distance);
    motion_add_outer(motion->loose, by->by_angle, step->loose_angle * step->loose_angle);
    motion->grain_distance = fmax(motion->grain_distance, step->grain_distance);
    motion->grain_angle = fmax(motion->grain_angle, step->grain_angle);
}

void create_motion_add(struct create_motion *motion, const struct create_step *step)
{
    const struct derivatives by = motion_derive(motion->theta, step);
    const double dx = step->distance * by.by_distance[0], dy = step->distance * by.by_distance[1];
    motion_carry(motion->scale, dx, dy);
    motion_carry_covariance(motion->loose, dx, dy);
    motion_add_errors(motion, step, &by);
    motion->x += dx;
    motion->y += dy;
    motion->theta += step->angle;
}

void create_motion_covariance(const struct create_motion *motion, double covariance[3][3])
{
    const double distance = UNIFORM_VARIANCE * motion->grain_distance * motion->grain_distance;
    const double angle = UNIFORM_VARIANCE * motion->grain_angle * motion->grain_angle;
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            covariance[i][j] = motion->loose[i][j];
            for (int k = 0; k < CREATE_SCALES; k++) {
                covariance[i][j] += motion->scale[i][k] * motion->scale[j][k];
            }
        }
    }
    /* Counters owe something at the beginning, which turns and shifts all that follows, and at the end. */
    motion_add_outer(covariance, (const double[3]){1, 0, 0}, distance);
    motion_add_outer(covariance, (const double[3]){-motion->y, motion->x, 1}, angle);
    motion_add_outer(covariance, (const double[3]){cos(motion->theta), sin(motion->theta), 0}, distance);
    motion_add_outer(covariance, (const double[3]){0, 0, 1}, angle);
}
