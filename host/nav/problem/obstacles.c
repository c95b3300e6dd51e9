#include "obstacles.h"

#include <math.h>
#include <stdlib.h>

static const double EDGE_M = 0.1;
static const double SQUARES_MOST = 65536.0;

static size_t obstacles_squares(const struct nav_obstacles *o)
{
    return (size_t)o->rows * (size_t)o->columns;
}

static int obstacles_index(double position, int count)
{
    return position > 0.0 ? (position < count ? (int)position : count - 1) : 0;
}

/* Number of the square under (x, y), or of the nearest. */
static size_t obstacles_square(const struct nav_obstacles *o, double x, double y)
{
    return (size_t)obstacles_index(y * o->per_m, o->rows) * (size_t)o->columns +
           (size_t)obstacles_index(x * o->per_m, o->columns);
}

static bool obstacles_touch(const struct nav_obstacles *o, int column, int row, const struct nav_box *box)
{
    double x0 = column * o->edge, y0 = row * o->edge;
    double dx = fmax(fmax(box->x0 - x0 - o->edge, x0 - box->x1), 0.0);
    double dy = fmax(fmax(box->y0 - y0 - o->edge, y0 - box->y1), 0.0);
    return dx * dx + dy * dy <= o->reach * o->reach;
}

/* What is done at a square within reach of box number `which`. */
typedef void obstacles_take(struct nav_obstacles *, size_t square, int which);

static void obstacles_count(struct nav_obstacles *o, size_t square, int which)
{
    o->unknown[square] += which >= o->arena->boxes - o->arena->unknown;
    o->first[square + 1]++;
}

static void obstacles_copy(struct nav_obstacles *o, size_t square, int which)
{
    uint32_t at = o->first[square + 1]++;
    o->box[at] = o->arena->box[which];
    o->which[at] = which;
}

static struct nav_box *obstacles_copy_of(struct nav_obstacles *o, size_t square, int which)
{
    uint32_t at = o->first[square];
    while (o->which[at] != which)
        at++;
    return &o->box[at];
}

static void obstacles_remove(struct nav_obstacles *o, size_t square, int which)
{
    *obstacles_copy_of(o, square, which) = (struct nav_box){INFINITY, INFINITY, -INFINITY, -INFINITY};
}

static void obstacles_restore(struct nav_obstacles *o, size_t square, int which)
{
    *obstacles_copy_of(o, square, which) = o->arena->box[which];
}

static void obstacles_visit(struct nav_obstacles *o, int which, obstacles_take *take)
{
    const struct nav_box *box = &o->arena->box[which];
    int i0 = obstacles_index((box->x0 - o->reach) * o->per_m, o->columns);
    int i1 = obstacles_index((box->x1 + o->reach) * o->per_m, o->columns);
    int j0 = obstacles_index((box->y0 - o->reach) * o->per_m, o->rows);
    int j1 = obstacles_index((box->y1 + o->reach) * o->per_m, o->rows);
    for (int j = j0; j <= j1; j++) {
        for (int i = i0; i <= i1; i++) {
            if (obstacles_touch(o, i, j, box))
                take(o, (size_t)j * (size_t)o->columns + (size_t)i, which);
        }
    }
}

static void obstacles_visit_all(struct nav_obstacles *o, obstacles_take *take)
{
    for (int b = 0; b < o->arena->boxes; b++)
        obstacles_visit(o, b, take);
}

/* Counts become places: first[n + 1] where square n begins, which filling turns into where it ends. */
static int obstacles_fill(struct nav_obstacles *o)
{
    size_t squares = obstacles_squares(o), sum = 0;
    obstacles_visit_all(o, obstacles_count);
    for (size_t n = 0; n < squares; n++) {
        uint32_t count = o->first[n + 1];
        o->first[n + 1] = (uint32_t)sum;
        sum += count;
        if (sum > UINT32_MAX / 2)
            return -1;
    }
    o->box = calloc(sum + 1, sizeof *o->box);
    o->which = calloc(sum + 1, sizeof *o->which);
    if (!o->box || !o->which)
        return -1;
    obstacles_visit_all(o, obstacles_copy);
    return 0;
}

static bool obstacles_by_wall(const struct nav_obstacles *o, int column, int row)
{
    double x0 = column * o->edge, y0 = row * o->edge, reach = o->reach;
    return x0 <= reach || y0 <= reach || x0 + o->edge >= o->arena->size_x - reach ||
           y0 + o->edge >= o->arena->size_y - reach;
}

int nav_obstacles_init(struct nav_obstacles *o, const struct nav_arena *arena, double reach)
{
    *o = (struct nav_obstacles){.arena = arena, .reach = reach};
    o->edge = fmax(EDGE_M, sqrt(arena->size_x * arena->size_y / SQUARES_MOST));
    o->per_m = 1.0 / o->edge;
    o->columns = (int)ceil(arena->size_x / o->edge);
    o->rows = (int)ceil(arena->size_y / o->edge);
    size_t squares = obstacles_squares(o);
    o->first = calloc(squares + 1, sizeof *o->first);
    o->unknown = calloc(squares + 1, sizeof *o->unknown);
    o->wall = calloc(squares + 1, 1);
    if (!o->first || !o->unknown || !o->wall || obstacles_fill(o))
        return -1;
    for (size_t n = 0; n < squares; n++)
        o->wall[n] = obstacles_by_wall(o, (int)(n % (size_t)o->columns), (int)(n / (size_t)o->columns));
    return 0;
}

void nav_obstacles_free(struct nav_obstacles *o)
{
    free(o->first);
    free(o->unknown);
    free(o->box);
    free(o->which);
    free(o->wall);
}

bool nav_obstacles_near(const struct nav_obstacles *o, double x, double y, struct nav_arena *near)
{
    size_t square = obstacles_square(o, x, y);
    uint32_t first = o->first[square], end = o->first[square + 1];
    if (first == end && !o->wall[square])
        return false;
    *near = *o->arena;
    near->boxes = (int)(end - first);
    near->unknown = (int)o->unknown[square];
    near->box = o->box + first;
    return true;
}

bool nav_obstacles_clear(const struct nav_obstacles *o, double x, double y, double radius)
{
    struct nav_arena near;
    return !nav_obstacles_near(o, x, y, &near) || nav_arena_free(&near, x, y, radius);
}

int nav_obstacles_at(const struct nav_obstacles *o, double x, double y)
{
    size_t square = obstacles_square(o, x, y);
    for (uint32_t n = o->first[square]; n < o->first[square + 1]; n++) {
        const struct nav_box *box = &o->box[n];
        if (x >= box->x0 && x <= box->x1 && y >= box->y0 && y <= box->y1)
            return o->which[n];
    }
    return -1;
}

void nav_obstacles_hide(struct nav_obstacles *o, int which, bool hidden)
{
    obstacles_visit(o, which, hidden ? obstacles_remove : obstacles_restore);
}

size_t nav_obstacles_bytes(const struct nav_obstacles *o)
{
    size_t squares = obstacles_squares(o);
    return squares * (2 * sizeof *o->first + 1) + o->first[squares] * (sizeof *o->box + sizeof *o->which);
}
