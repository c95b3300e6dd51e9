#include "ground.h"

#include <math.h>
#include <stdlib.h>

#include "problem.h"

/* A robot's radius is two cells, where there is memory for so many: no way through a wall is between cells. */
static const double CELLS_MOST = 4e6;

static bool ground_unknown(const struct nav_obstacles *o, double x, double y)
{
    struct nav_arena near;
    if (o->arena->unknown == 0 || !nav_obstacles_near(o, x, y, &near))
        return false;
    for (int b = near.boxes - near.unknown; b < near.boxes; b++) {
        const struct nav_box *box = &near.box[b];
        if (x >= box->x0 && x <= box->x1 && y >= box->y0 && y <= box->y1)
            return true;
    }
    return false;
}

static int ground_index(double position, int count)
{
    return (int)fmax(fmin(position, count - 1), 0.0);
}

/* Reaches what is next to a cell; cells whose neighbours are still to be looked at wait. */
static void ground_spread(struct nav_ground *g, int cell, int *waiting, long *count)
{
    static const int STEP_X[] = {1, -1, 0, 0}, STEP_Y[] = {0, 0, 1, -1};
    for (int k = 0; k < 4; k++) {
        int i = cell % g->columns + STEP_X[k], j = cell / g->columns + STEP_Y[k], to = j * g->columns + i;
        if (i < 0 || j < 0 || i >= g->columns || j >= g->rows || g->state[to] != NAV_GROUND_CUT_OFF)
            continue;
        g->state[to] = NAV_GROUND_REACHED;
        waiting[(*count)++] = to;
    }
}

/* Finds what can be reached, and from the areas the weight. */
static int ground_flood(struct nav_ground *g)
{
    int cells = g->columns * g->rows;
    long count = 0, mapped = 0, reached = 0;
    int *waiting = malloc(((size_t)cells + 1) * sizeof *waiting);
    if (!waiting)
        return -1;
    for (int n = 0; n < cells; n++) {
        if (g->state[n] == NAV_GROUND_MAPPED)
            ground_spread(g, n, waiting, &count);
    }
    while (count > 0)
        ground_spread(g, waiting[--count], waiting, &count);
    for (int n = 0; n < cells; n++) {
        mapped += g->state[n] == NAV_GROUND_MAPPED;
        reached += g->state[n] == NAV_GROUND_REACHED;
    }
    g->open = (double)(mapped + reached) / cells;
    g->weight = fmin(NAV_ANYWHERE / (1.0 - NAV_ANYWHERE) * (double)mapped / fmax((double)reached, 1.0), 1.0);
    free(waiting);
    return 0;
}

int nav_ground_init(struct nav_ground *g, const struct nav_obstacles *o, double radius)
{
    const struct nav_arena *arena = o->arena;
    double edge = fmax(radius / 2.0, sqrt(arena->size_x * arena->size_y / CELLS_MOST));
    *g = (struct nav_ground){.weight = 1.0, .open = 1.0};
    if (arena->unknown == 0)
        return 0;
    g->per_m = 1.0 / edge;
    g->columns = (int)ceil(arena->size_x / edge);
    g->rows = (int)ceil(arena->size_y / edge);
    g->state = malloc((size_t)g->columns * (size_t)g->rows);
    for (int n = 0; g->state && n < g->columns * g->rows; n++) {
        double x = (n % g->columns + 0.5) * edge, y = (n / g->columns + 0.5) * edge;
        enum nav_ground_state clear = ground_unknown(o, x, y) ? NAV_GROUND_CUT_OFF : NAV_GROUND_MAPPED;
        g->state[n] = (uint8_t)(nav_obstacles_clear(o, x, y, radius) ? clear : NAV_GROUND_BLOCKED);
    }
    return g->state ? ground_flood(g) : -1;
}

void nav_ground_free(struct nav_ground *g)
{
    free(g->state);
}

/* Of a cell whose middle is blocked its neighbours decide. */
double nav_ground_prior(const struct nav_ground *g, const struct nav_obstacles *o, double x, double y)
{
    if (!ground_unknown(o, x, y))
        return 1.0;
    int i = ground_index(x * g->per_m, g->columns), j = ground_index(y * g->per_m, g->rows);
    int around = g->state[j * g->columns + i] == NAV_GROUND_BLOCKED;
    for (int b = j - around; b <= j + around; b++) {
        for (int a = i - around; a <= i + around; a++) {
            if (a < 0 || b < 0 || a >= g->columns || b >= g->rows)
                continue;
            if (g->state[b * g->columns + a] % 2 == 1) /* mapped or reached */
                return g->weight;
        }
    }
    return 0.0;
}
