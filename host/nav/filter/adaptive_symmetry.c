#include "adaptive_symmetry.h"

#include <math.h>

static const double SAME_M = 1e-6;

static bool same(double a, double b)
{
    return fabs(a - b) <= SAME_M;
}

/* A point turned a quarter about the centre of a square arena of this size: (x, y) -> (size - y, x). */
static struct nav_box quarter(const struct nav_arena *arena, struct nav_box b)
{
    return (struct nav_box){arena->size_x - b.y1, b.x0, arena->size_x - b.y0, b.x1};
}

static struct nav_box half(const struct nav_arena *arena, struct nav_box b)
{
    return (struct nav_box){arena->size_x - b.x1, arena->size_y - b.y1, arena->size_x - b.x0, arena->size_y - b.y0};
}

static bool has_box(const struct nav_arena *arena, struct nav_box b)
{
    for (int i = 0; i < arena->boxes; i++) {
        const struct nav_box *o = &arena->box[i];
        if (same(o->x0, b.x0) && same(o->y0, b.y0) && same(o->x1, b.x1) && same(o->y1, b.y1))
            return true;
    }
    return false;
}

static bool boxes_alike(const struct nav_arena *arena, struct nav_box (*turn)(const struct nav_arena *, struct nav_box))
{
    for (int i = 0; i < arena->boxes; i++) {
        if (!has_box(arena, turn(arena, arena->box[i])))
            return false;
    }
    return true;
}

/* Tiles must end where the arena does: a partial one at the far side has no partner. */
static bool whole_tiles(const struct nav_arena *arena)
{
    return same(arena->columns * arena->tile, arena->size_x) && same(arena->rows * arena->tile, arena->size_y);
}

static bool half_alike(const struct nav_arena *arena)
{
    int tiles = arena->rows * arena->columns;
    for (int n = 0; n < tiles; n++) {
        if (arena->floor[n] != arena->floor[tiles - 1 - n])
            return false;
    }
    return whole_tiles(arena) && boxes_alike(arena, half);
}

static bool quarter_alike(const struct nav_arena *arena)
{
    int size = arena->columns;
    if (arena->rows != size || !same(arena->size_x, arena->size_y))
        return false;
    for (int n = 0; n < size * size; n++) {
        if (arena->floor[n] != arena->floor[n % size * size + size - 1 - n / size])
            return false;
    }
    return whole_tiles(arena) && boxes_alike(arena, quarter);
}

int adaptive_symmetry(const struct nav_arena *arena)
{
    return quarter_alike(arena) ? 4 : half_alike(arena) ? 2 : 1;
}
