/* Directions of surfaces that object whiskers touch: wrapped Gaussian with a share of outliers.
 *
 * Expected is the outward normal, in the robot's frame, of the wall or box face at which the unbent whisker's line
 * ends. Where another face is as near as contacts are known to, either or their corner may be what is touched, and a
 * corner has no normal: not known there, as where the line meets nothing. A broken whisker reports any direction. */
#include "measurement.h"

#include <math.h>

enum { NORMAL_CODES = 180, NORMAL_UNKNOWN = NORMAL_CODES };

static const double LEAST_RAD = 0.01; /* rounding to codes alone has 0.01 */
static const double MOST_RAD = NAV_PI;

/* The face nearest to a point on it, and how near the next one is. */
struct normal_face {
    double x, y;       /* outward, unit */
    double off, other; /* m from the point: this face's; the nearest other face's */
};

static int normal_count(const struct nav_robot *robot)
{
    return robot->normals ? robot->rays : 0;
}

static int normal_init(struct nav_model *model, const struct nav_arena *arena, const struct nav_robot *robot,
                       double blur_m)
{
    (void)arena;
    const struct nav_ray *ray = &robot->ray[model->index];
    model->values = 2;
    model->codes = NORMAL_CODES + 1;
    model->place.x = ray->x;
    model->place.y = ray->y;
    model->place.c = cos(ray->yaw);
    model->place.s = sin(ray->yaw);
    model->length = ray->length;
    model->spacing = model->settings->radial.spacing_m;
    model->sigma = hypot(robot->radial_sigma, blur_m);
    model->reach = model->length + 3.0 * hypot(model->settings->radial.edge_m, blur_m);
    return 0;
}

static const double *normal_cells(const struct nav_model *model, const struct nav_row *row)
{
    return row->normal ? row->normal + (ptrdiff_t)2 * model->index : NULL;
}

static enum nav_check normal_check(const struct nav_model *model, const double *reading, uint64_t *bad)
{
    (void)model;
    if (!reading || isnan(reading[0]))
        return NAV_NOT_READ;
    if (fabs(reading[0]) <= 2.0 * NAV_PI && reading[1] > 0.0 && reading[1] <= MOST_RAD)
        return NAV_READ;
    *bad += 1;
    return NAV_BAD;
}

static double normal_novelty(const struct nav_model *model, struct nav_track *track, struct nav_repeat *repeat,
                             const double *reading)
{
    (void)repeat;
    (void)reading;
    return nav_novelty(track->moved, model->spacing);
}

static bool normal_sharp(const double *reading)
{
    (void)reading;
    return false;
}

/* Considers the sides of a box; outward: 1, or -1 for the walls around the arena. */
static void normal_consider(const struct nav_box *box, double outward, double x, double y, struct normal_face *face)
{
    const double off[4] = {box->x0 - x, x - box->x1, box->y0 - y, y - box->y1};
    int side = 0;
    for (int n = 1; n < 4; n++)
        side = off[n] > off[side] ? n : side;
    double distance = fabs(off[side]);
    if (distance >= face->off) {
        face->other = fmin(face->other, distance);
        return;
    }
    double sign = side % 2 ? outward : -outward;
    int across = side < 2 ? 2 : 0;
    face->other = fmin(face->off, fmin(fabs(off[across]), fabs(off[across + 1])));
    face->off = distance;
    face->x = side < 2 ? sign : 0.0;
    face->y = side < 2 ? 0.0 : sign;
}

static struct normal_face normal_face_at(const struct nav_arena *near, double x, double y)
{
    const struct nav_box walls = {0.0, 0.0, near->size_x, near->size_y};
    struct normal_face face = {.off = INFINITY};
    normal_consider(&walls, -1.0, x, y, &face);
    for (int b = 0; b < near->boxes - near->unknown; b++)
        normal_consider(&near->box[b], 1.0, x, y, &face);
    return face;
}

double nav_normal_direction(const struct nav_model *model, const struct nav_arena *near, const struct nav_place *at)
{
    double x = nav_place_x(at, model->place.x, model->place.y), y = nav_place_y(at, model->place.x, model->place.y);
    double c = at->c * model->place.c - at->s * model->place.s, s = at->s * model->place.c + at->c * model->place.s;
    double range = nav_arena_range_along(near, x, y, c, s, model->reach);
    if (!(range > 0.0 && isfinite(range)))
        return NAN;
    struct normal_face face = normal_face_at(near, x + range * c, y + range * s);
    if (face.other <= model->sigma)
        return NAN;
    return atan2(at->c * face.y - at->s * face.x, at->c * face.x + at->s * face.y);
}

static uint8_t normal_code(double direction)
{
    if (isnan(direction))
        return NORMAL_UNKNOWN;
    double turns = direction / (2.0 * NAV_PI);
    return (uint8_t)((int)((turns - floor(turns)) * NORMAL_CODES) % NORMAL_CODES);
}

static void normal_expect(const struct nav_model *model, int count, const struct nav_arena *arena,
                          const struct nav_arena *near, const struct nav_place *at, uint8_t *codes)
{
    (void)arena;
    for (int r = 0; r < count; r++)
        codes[r] = normal_code(near ? nav_normal_direction(&model[r], near, at) : (double)NAN);
}

static void normal_fill(struct nav_model *model, const double *reading, double *ratio)
{
    double sd = fmax(reading[1], LEAST_RAD), outlier = model->settings->normal.outlier;
    for (int k = 0; k < NORMAL_CODES; k++) {
        double off = nav_wrap(reading[0] - (k + 0.5) * 2.0 * NAV_PI / NORMAL_CODES), density = 0.0;
        for (int turn = -1; turn <= 1; turn++) {
            double z = (off + turn * 2.0 * NAV_PI) / sd;
            density += exp(-0.5 * z * z) / (sd * sqrt(2.0 * NAV_PI));
        }
        ratio[k] = (1.0 - outlier) * density * 2.0 * NAV_PI + fmax(outlier, 1e-30);
    }
    ratio[NORMAL_UNKNOWN] = 1.0;
}

const struct nav_measurement NAV_NORMAL_MEASUREMENT = {.name = "normal",
                                                       .solid = true,
                                                       .count = normal_count,
                                                       .init = normal_init,
                                                       .cells = normal_cells,
                                                       .check = normal_check,
                                                       .novelty = normal_novelty,
                                                       .sharp = normal_sharp,
                                                       .expect = normal_expect,
                                                       .fill = normal_fill};
