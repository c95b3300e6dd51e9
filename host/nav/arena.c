#include "arena.h"

#include <math.h>

static int tile_index(double position, double tile, int count)
{
    double index = floor(position / tile);
    if (!(index > 0.0))
        return 0;
    return index < count ? (int)index : count - 1;
}

int nav_arena_texture(const struct nav_arena *arena, double x, double y)
{
    int column = tile_index(x, arena->tile, arena->columns), row = tile_index(y, arena->tile, arena->rows);
    return arena->floor[row * arena->columns + column];
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
    return (struct span){fmin(a, b), fmax(a, b)};
}

static struct span across(const struct nav_box *box, double x, double y, double c, double s)
{
    struct span h = between(x, c, box->x0, box->x1), v = between(y, s, box->y0, box->y1);
    return (struct span){fmax(h.enter, v.enter), fmin(h.leave, v.leave)};
}

double nav_arena_range(const struct nav_arena *arena, double x, double y, double heading, double reach)
{
    return nav_arena_range_along(arena, x, y, cos(heading), sin(heading), reach);
}

double nav_arena_range_along(const struct nav_arena *arena, double x, double y, double c, double s, double reach)
{
    const struct nav_box walls = {0.0, 0.0, arena->size_x, arena->size_y};
    if (x <= walls.x0 || x >= walls.x1 || y <= walls.y0 || y >= walls.y1)
        return 0.0;
    double nearest = across(&walls, x, y, c, s).leave;
    for (int i = 0; i < arena->boxes; i++) {
        struct span hit = across(&arena->box[i], x, y, c, s);
        if (hit.enter <= hit.leave && hit.leave > 0.0)
            nearest = fmin(nearest, fmax(hit.enter, 0.0));
    }
    return nearest <= reach ? nearest : (double)INFINITY;
}

bool nav_arena_free(const struct nav_arena *arena, double x, double y, double radius)
{
    if (!(x > radius && x < arena->size_x - radius && y > radius && y < arena->size_y - radius))
        return false;
    for (int i = 0; i < arena->boxes; i++) {
        const struct nav_box *box = &arena->box[i];
        double dx = fmax(fmax(box->x0 - x, x - box->x1), 0.0), dy = fmax(fmax(box->y0 - y, y - box->y1), 0.0);
        if (dx * dx + dy * dy <= radius * radius)
            return false;
    }
    return true;
}
