#include "arena.h"

#include <math.h>

static size_t arena_tile_index(double coordinate, double tile, size_t count)
{
    double index = floor(coordinate / tile);
    return (size_t)fmax(0, fmin((double)(count - 1), index));
}

size_t sim_arena_tile(const struct sim_scene *scene, struct sim_point at)
{
    size_t column = arena_tile_index(at.x, scene->tile_m, scene->columns);
    return arena_tile_index(at.y, scene->tile_m, scene->rows) * scene->columns + column;
}

size_t sim_arena_texture(const struct sim_scene *scene, struct sim_point at)
{
    return scene->tile[sim_arena_tile(scene, at)];
}

/* Distance to the borders of the tile's interval along one axis; the last tile may be cut short by the wall. */
static double arena_inside_interval(double coordinate, double tile, size_t count, double size)
{
    double low = (double)arena_tile_index(coordinate, tile, count) * tile;
    return fmin(coordinate - low, fmin(low + tile, size) - coordinate);
}

double sim_arena_inside(const struct sim_scene *scene, struct sim_point at)
{
    double x = arena_inside_interval(at.x, scene->tile_m, scene->columns, scene->size_x);
    double y = arena_inside_interval(at.y, scene->tile_m, scene->rows, scene->size_y);
    return fmax(0, fmin(x, y));
}

/* Narrows the part [*enter, *leave] of a path to where it is between low and high along one axis. Returns true if the
 * path enters through this axis, that is, later than *enter was before. */
static bool arena_clip(double from, double along, double low, double high, double *enter, double *leave)
{
    if (fabs(along) < 1e-15) {
        if (from < low || from > high)
            *leave = -1;
        return false;
    }
    double first = (low - from) / along;
    double last = (high - from) / along;
    if (first > last) {
        double swap = first;
        first = last;
        last = swap;
    }
    bool later = first > *enter;
    if (later)
        *enter = first;
    *leave = fmin(*leave, last);
    return later;
}

static bool arena_ray_box(const struct sim_box *box, struct sim_point from, struct sim_point along, struct sim_hit *hit)
{
    double enter = 0, leave = 1;
    struct sim_point normal = {0, 0};
    if (arena_clip(from.x, along.x, box->x0, box->x1, &enter, &leave))
        normal = (struct sim_point){copysign(1, along.x), 0};
    if (arena_clip(from.y, along.y, box->y0, box->y1, &enter, &leave))
        normal = (struct sim_point){0, copysign(1, along.y)};
    *hit = (struct sim_hit){enter, normal, box->surface};
    return enter <= leave;
}

/* Fraction of a path at which its coordinate along one axis leaves [0, size]; above 1 if it does not. */
static double arena_leaves(double from, double along, double size)
{
    if (from < 0 || from > size)
        return 0;
    if (from + along < 0)
        return -from / along;
    return from + along > size ? (size - from) / along : 2;
}

static bool arena_ray_wall(const struct sim_scene *scene, struct sim_point from, struct sim_point along,
                           struct sim_hit *hit)
{
    double x = arena_leaves(from.x, along.x, scene->size_x);
    double y = arena_leaves(from.y, along.y, scene->size_y);
    if (x <= y)
        *hit = (struct sim_hit){x, {from.x + along.x * x > scene->size_x / 2 ? 1 : -1, 0}, scene->wall};
    else
        *hit = (struct sim_hit){y, {0, from.y + along.y * y > scene->size_y / 2 ? 1 : -1}, scene->wall};
    return hit->fraction <= 1;
}

bool sim_arena_ray(const struct sim_scene *scene, struct sim_point from, struct sim_point to, struct sim_hit *hit)
{
    struct sim_point along = {to.x - from.x, to.y - from.y};
    bool any = arena_ray_wall(scene, from, along, hit);
    for (size_t i = 0; i < scene->obstacles; i++) {
        struct sim_hit nearer;
        if (arena_ray_box(&scene->obstacle[i], from, along, &nearer) && (!any || nearer.fraction < hit->fraction)) {
            *hit = nearer;
            any = true;
        }
    }
    return any;
}

static double arena_distance_to_box(const struct sim_box *box, struct sim_point at)
{
    double x = fmax(box->x0 - at.x, at.x - box->x1);
    double y = fmax(box->y0 - at.y, at.y - box->y1);
    if (x <= 0 || y <= 0)
        return fmax(x, y);
    return hypot(x, y);
}

double sim_arena_clearance(const struct sim_scene *scene, struct sim_point at)
{
    double nearest = fmin(fmin(at.x, scene->size_x - at.x), fmin(at.y, scene->size_y - at.y));
    for (size_t i = 0; i < scene->obstacles; i++)
        nearest = fmin(nearest, arena_distance_to_box(&scene->obstacle[i], at));
    return nearest;
}
