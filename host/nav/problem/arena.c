#include "arena.h"

#include <math.h>

static int tile_index(double position, double tile, int count)
{
    double index = position / tile;
    if (!(index > 0.0))
        return 0;
    return index < count ? (int)index : count - 1;
}

int nav_arena_tile(const struct nav_arena *arena, double x, double y)
{
    return tile_index(y, arena->tile, arena->rows) * arena->columns + tile_index(x, arena->tile, arena->columns);
}

int nav_arena_texture(const struct nav_arena *arena, double x, double y)
{
    return arena->floor[nav_arena_tile(arena, x, y)];
}

/* fmin and fmax are calls, for the sake of NaN; here there is none. */
static double lesser(double a, double b)
{
    return a < b ? a : b;
}

static double greater(double a, double b)
{
    return a > b ? a : b;
}

struct span {
    double enter, leave; /* along the ray, m */
};

/* Part of a ray between two parallel lines. */
static struct span between(double start, double direction, double low, double high)
{
    if (direction == 0.0)
        return start > low && start < high ? (struct span){-INFINITY, INFINITY} : (struct span){INFINITY, -INFINITY};
    double a = (low - start) / direction, b = (high - start) / direction;
    return (struct span){lesser(a, b), greater(a, b)};
}

static struct span across(const struct nav_box *box, double x, double y, double c, double s)
{
    struct span h = between(x, c, box->x0, box->x1), v = between(y, s, box->y0, box->y1);
    return (struct span){greater(h.enter, v.enter), lesser(h.leave, v.leave)};
}

/* Whether the rectangle around a ray lies clear of a box: most boxes of an arena need no more. */
static bool apart(const struct nav_box *box, const struct nav_box *around)
{
    return around->x1 < box->x0 || around->x0 > box->x1 || around->y1 < box->y0 || around->y0 > box->y1;
}

static bool inside(const struct nav_box *box, double x, double y)
{
    return x > box->x0 && x < box->x1 && y > box->y0 && y < box->y1;
}

double nav_arena_range(const struct nav_arena *arena, double x, double y, double heading, double reach)
{
    return nav_arena_range_along(arena, x, y, cos(heading), sin(heading), reach);
}

/* Distance along a ray to the nearest of boxes first .. end - 1 that meets the rectangle around it. */
static double nearest_of(const struct nav_arena *arena, int first, int end, const struct nav_box *around, double x,
                         double y, double c, double s)
{
    double nearest = INFINITY;
    for (int i = first; i < end; i++) {
        if (apart(&arena->box[i], around))
            continue;
        struct span hit = across(&arena->box[i], x, y, c, s);
        if (hit.enter <= hit.leave && hit.leave > 0.0)
            nearest = lesser(nearest, greater(hit.enter, 0.0));
    }
    return nearest;
}

double nav_arena_range_along(const struct nav_arena *arena, double x, double y, double c, double s, double reach)
{
    const struct nav_box walls = {0.0, 0.0, arena->size_x, arena->size_y};
    int solid = arena->boxes - arena->unknown;
    double ex = x + c * reach, ey = y + s * reach;
    const struct nav_box around = {lesser(x, ex), lesser(y, ey), greater(x, ex), greater(y, ey)};
    if (!inside(&walls, x, y))
        return 0.0;
    double nearest = inside(&walls, ex, ey) ? (double)INFINITY : across(&walls, x, y, c, s).leave;
    nearest = lesser(nearest, nearest_of(arena, 0, solid, &around, x, y, c, s));
    if (arena->unknown > 0 && nearest_of(arena, solid, arena->boxes, &around, x, y, c, s) < lesser(nearest, reach))
        return NAN;
    return nearest <= reach ? nearest : (double)INFINITY;
}

bool nav_arena_free(const struct nav_arena *arena, double x, double y, double radius)
{
    if (!(x > radius && x < arena->size_x - radius && y > radius && y < arena->size_y - radius))
        return false;
    for (int i = 0; i < arena->boxes - arena->unknown; i++) {
        const struct nav_box *box = &arena->box[i];
        double dx = greater(greater(box->x0 - x, x - box->x1), 0.0);
        double dy = greater(greater(box->y0 - y, y - box->y1), 0.0);
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
        best = greater(best, reading[k]);
    for (int k = 0; k < codes; k++)
        likelihood[k] = exp(reading[k] - best);
}
