#include "arena.h"

#include <math.h>

static int arena_tile_index(double position, double tile, int count)
{
    double index = position / tile;
    if (!(index > 0.0))
        return 0;
    return index < count ? (int)index : count - 1;
}

int nav_arena_tile(const struct nav_arena *arena, double x, double y)
{
    return arena_tile_index(y, arena->tile, arena->rows) * arena->columns +
           arena_tile_index(x, arena->tile, arena->columns);
}

int nav_arena_texture(const struct nav_arena *arena, double x, double y)
{
    return arena->floor[nav_arena_tile(arena, x, y)];
}

/* fmin and fmax are calls, for the sake of NaN; here there is none. */
static double arena_lesser(double a, double b)
{
    return a < b ? a : b;
}

static double arena_greater(double a, double b)
{
    return a > b ? a : b;
}

struct span {
    double enter, leave; /* along the ray, m */
};

/* Part of a ray between two parallel lines. */
static struct span arena_between(double start, double direction, double low, double high)
{
    if (direction == 0.0)
        return start > low && start < high ? (struct span){-INFINITY, INFINITY} : (struct span){INFINITY, -INFINITY};
    double a = (low - start) / direction, b = (high - start) / direction;
    return (struct span){arena_lesser(a, b), arena_greater(a, b)};
}

static struct span arena_across(const struct nav_box *box, double x, double y, double c, double s)
{
    struct span h = arena_between(x, c, box->x0, box->x1), v = arena_between(y, s, box->y0, box->y1);
    return (struct span){arena_greater(h.enter, v.enter), arena_lesser(h.leave, v.leave)};
}

/* Whether the rectangle around a ray lies clear of a box: most boxes of an arena need no more. */
static bool arena_apart(const struct nav_box *box, const struct nav_box *around)
{
    return around->x1 < box->x0 || around->x0 > box->x1 || around->y1 < box->y0 || around->y0 > box->y1;
}

static bool arena_inside(const struct nav_box *box, double x, double y)
{
    return x > box->x0 && x < box->x1 && y > box->y0 && y < box->y1;
}

double nav_arena_range(const struct nav_arena *arena, double x, double y, double heading, double reach)
{
    return nav_arena_range_along(arena, x, y, cos(heading), sin(heading), reach);
}

/* Distance along a ray to the nearest of boxes first .. end - 1 that meets the rectangle around it. */
static double arena_nearest_of(const struct nav_arena *arena, int first, int end, const struct nav_box *around,
                               double x, double y, double c, double s)
{
    double nearest = INFINITY;
    for (int i = first; i < end; i++) {
        if (arena_apart(&arena->box[i], around))
            continue;
        struct span hit = arena_across(&arena->box[i], x, y, c, s);
        if (hit.enter <= hit.leave && hit.leave > 0.0)
            nearest = arena_lesser(nearest, arena_greater(hit.enter, 0.0));
    }
    return nearest;
}

double nav_arena_range_along(const struct nav_arena *arena, double x, double y, double c, double s, double reach)
{
    const struct nav_box walls = {0.0, 0.0, arena->size_x, arena->size_y};
    int solid = arena->boxes - arena->unknown;
    double ex = x + c * reach, ey = y + s * reach;
    const struct nav_box around = {arena_lesser(x, ex), arena_lesser(y, ey), arena_greater(x, ex),
                                   arena_greater(y, ey)};
    if (!arena_inside(&walls, x, y))
        return 0.0;
    double nearest = arena_inside(&walls, ex, ey) ? (double)INFINITY : arena_across(&walls, x, y, c, s).leave;
    nearest = arena_lesser(nearest, arena_nearest_of(arena, 0, solid, &around, x, y, c, s));
    if (arena->unknown > 0 &&
        arena_nearest_of(arena, solid, arena->boxes, &around, x, y, c, s) < arena_lesser(nearest, reach))
        return NAN;
    return nearest <= reach ? nearest : (double)INFINITY;
}

bool nav_arena_free(const struct nav_arena *arena, double x, double y, double radius)
{
    if (!(x > radius && x < arena->size_x - radius && y > radius && y < arena->size_y - radius))
        return false;
    for (int i = 0; i < arena->boxes - arena->unknown; i++) {
        const struct nav_box *box = &arena->box[i];
        double dx = arena_greater(arena_greater(box->x0 - x, x - box->x1), 0.0);
        double dy = arena_greater(arena_greater(box->y0 - y, y - box->y1), 0.0);
        if (dx * dx + dy * dy <= radius * radius)
            return false;
    }
    return true;
}

int nav_sensor_map_expect(const void *self, double x, double y, double theta)
{
    const struct nav_sensor_map *map = self;
    double c = cos(theta), s = sin(theta);
    double column = (x + c * map->x - s * map->y) / map->cell, row = (y + s * map->x + c * map->y) / map->cell;
    if (!(column >= 0.0 && column < map->columns && row >= 0.0 && row < map->rows))
        return -1;
    return map->code[(size_t)row * (size_t)map->columns + (size_t)column];
}

void nav_sensor_map_fill(const void *self, const double *reading, double *likelihood)
{
    int codes = ((const struct nav_sensor_map *)self)->codes;
    double best = reading[0];
    for (int k = 1; k < codes; k++)
        best = arena_greater(best, reading[k]);
    for (int k = 0; k < codes; k++)
        likelihood[k] = exp(reading[k] - best);
}
