#include "arena.h"

#include <math.h>

static int tile_index(double position, double tile, int count)
{
    double index = position / tile;
    if (!(index > 0.0))
        return 0;
    return index < count ? (int)index : count - 1;
}

int nav_arena_texture(const struct nav_arena *arena, double x, double y)
{
    int column = tile_index(x, arena->tile, arena->columns), row = tile_index(y, arena->tile, arena->rows);
    return arena->floor[row * arena->columns + column];
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

double nav_arena_range_along(const struct nav_arena *arena, double x, double y, double c, double s, double reach)
{
    const struct nav_box walls = {0.0, 0.0, arena->size_x, arena->size_y};
    double ex = x + c * reach, ey = y + s * reach;
    const struct nav_box around = {lesser(x, ex), lesser(y, ey), greater(x, ex), greater(y, ey)};
    if (!inside(&walls, x, y))
        return 0.0;
    double nearest = inside(&walls, ex, ey) ? (double)INFINITY : across(&walls, x, y, c, s).leave;
    for (int i = 0; i < arena->boxes; i++) {
        if (apart(&arena->box[i], &around))
            continue;
        struct span hit = across(&arena->box[i], x, y, c, s);
        if (hit.enter <= hit.leave && hit.leave > 0.0)
            nearest = lesser(nearest, greater(hit.enter, 0.0));
    }
    return nearest <= reach ? nearest : (double)INFINITY;
}

bool nav_arena_free(const struct nav_arena *arena, double x, double y, double radius)
{
    if (!(x > radius && x < arena->size_x - radius && y > radius && y < arena->size_y - radius))
        return false;
    for (int i = 0; i < arena->boxes; i++) {
        const struct nav_box *box = &arena->box[i];
        double dx = greater(greater(box->x0 - x, x - box->x1), 0.0);
        double dy = greater(greater(box->y0 - y, y - box->y1), 0.0);
        if (dx * dx + dy * dy <= radius * radius)
            return false;
    }
    return true;
}
