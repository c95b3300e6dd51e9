#include "grid_view.h"

#include <math.h>

#include "pose.h"

static const double HITS_LEAST = 1.5, THERE_LEAST = 0.3; /* of a cell that is shown */
static const double SAME_RAD = 0.15, SAME_M = 0.01;      /* between a cell and the stretch that it continues */
static const double GAP_M = 2.5 * NAV_GRID_CELL_M;       /* between their middles */
enum { AROUND = 2, WHOLE = NAV_GRID_SIDE };

static double view_middle(int index)
{
    return (index - WHOLE / 2 + 0.5) * NAV_GRID_CELL_M;
}

/* A whisker from the free side: free is where whiskers went through. */
static struct nav_grid_whisker view_whisker(struct nav_grid g, int column, int row)
{
    double x = 0.0, y = 0.0;
    for (int r = -AROUND; r <= AROUND; r++) {
        for (int c = -AROUND; c <= AROUND; c++) {
            const struct nav_grid_cell *cell = nav_grid_cell_at(g.pool, g.map, column + c, row + r);
            double free = (double)cell->passed / ((double)cell->passed + (double)cell->hits + 1.0);
            x -= free * c;
            y -= free * r;
        }
    }
    double length = hypot(x, y);
    return (struct nav_grid_whisker){.c = length > 0.0 ? x / length : 1.0, .s = length > 0.0 ? y / length : 0.0};
}

/* A cell's part of a surface as a stretch. False: nothing solid is there. */
static bool view_cell(struct nav_grid g, int column, int row, struct nav_mapper_face *out)
{
    const struct nav_grid_cell *cell = nav_grid_cell_at(g.pool, g.map, column, row);
    double hits = (double)cell->hits;
    struct nav_grid_surface f;
    if (hits < HITS_LEAST || hits < THERE_LEAST * (hits + (double)cell->passed))
        return false;
    struct nav_grid_whisker w = view_whisker(g, column, row);
    double x = view_middle(column) + (double)cell->x / hits, y = view_middle(row) + (double)cell->y / hits;
    if (!nav_grid_surface(g, x, y, &w, &f))
        return false;
    double off = f.nx * (x - f.x) + f.ny * (y - f.y), half = 0.5 * NAV_GRID_CELL_M;
    x -= off * f.nx;
    y -= off * f.ny;
    *out = (struct nav_mapper_face){.x0 = x + half * f.ny,
                                    .y0 = y - half * f.nx,
                                    .x1 = x - half * f.ny,
                                    .y1 = y + half * f.nx,
                                    .normal = atan2(f.ny, f.nx),
                                    .normal_sigma = sqrt(f.normal_var),
                                    .offset_sigma = sqrt(f.variance / (hits + 1.0)),
                                    .hits = hits};
    return true;
}

/* Lengthens a stretch by a cell's, where that continues it. */
static bool view_joins(struct nav_mapper_face *s, const struct nav_mapper_face *cell)
{
    double turn = nav_wrap(cell->normal - s->normal);
    double mx = 0.5 * (cell->x0 + cell->x1), my = 0.5 * (cell->y0 + cell->y1);
    double nx = cos(s->normal), ny = sin(s->normal), length = hypot(s->x1 - s->x0, s->y1 - s->y0);
    double off = nx * (mx - s->x0) + ny * (my - s->y0), along = -ny * (mx - s->x0) + nx * (my - s->y0);
    if (fabs(turn) > SAME_RAD || fabs(off) > SAME_M || along < -GAP_M || along > length + GAP_M)
        return false;
    double share = cell->hits / (s->hits + cell->hits);
    double low = fmin(0.0, along - 0.5 * NAV_GRID_CELL_M), high = fmax(length, along + 0.5 * NAV_GRID_CELL_M);
    s->normal = nav_wrap(s->normal + share * turn);
    s->hits += cell->hits;
    s->normal_sigma = fmin(s->normal_sigma, cell->normal_sigma);
    s->offset_sigma = fmin(s->offset_sigma, cell->offset_sigma);
    /* The middle keeps its place but for the shift; the ends follow the normal. */
    double middle = 0.5 * (low + high), half = 0.5 * (high - low);
    double x = s->x0 - ny * middle + share * off * nx, y = s->y0 + nx * middle + share * off * ny;
    nx = cos(s->normal);
    ny = sin(s->normal);
    s->x0 = x + half * ny;
    s->y0 = y - half * nx;
    s->x1 = x - half * ny;
    s->y1 = y + half * nx;
    return true;
}

struct view_bounds {
    int from[2], until[2];
};

/* Columns and rows of the leaves that were ever written. */
static struct view_bounds view_bounds(struct nav_grid g)
{
    enum { WIDE = NAV_GRID_FAN * NAV_GRID_FAN };
    struct view_bounds b = {{WHOLE, WHOLE}, {0, 0}};
    for (int n = 0; n < NAV_GRID_ROOT * NAV_GRID_ROOT * WIDE; n++) {
        int node = n / WIDE, leaf = n % WIDE;
        if (!g.pool->node[g.map->node[node]].leaf[leaf])
            continue;
        int at[2] = {node % NAV_GRID_ROOT * WIDE + leaf % NAV_GRID_FAN * NAV_GRID_FAN,
                     node / NAV_GRID_ROOT * WIDE + leaf / NAV_GRID_FAN * NAV_GRID_FAN};
        for (int axis = 0; axis < 2; axis++) {
            b.from[axis] = at[axis] < b.from[axis] ? at[axis] : b.from[axis];
            b.until[axis] = at[axis] + NAV_GRID_FAN > b.until[axis] ? at[axis] + NAV_GRID_FAN : b.until[axis];
        }
    }
    return b;
}

long nav_grid_view_faces(struct nav_grid g, struct nav_mapper_face *out, long room)
{
    struct view_bounds b = view_bounds(g);
    struct nav_mapper_face cell;
    long count = 0;
    for (int row = b.from[1]; row < b.until[1]; row++) {
        for (int column = b.from[0]; column < b.until[0]; column++) {
            if (!view_cell(g, column, row, &cell))
                continue;
            long n = 0;
            while (n < count && n < room && !view_joins(&out[n], &cell))
                n++;
            if (n < count && n < room)
                continue;
            cell.face = (int)count;
            if (count < room)
                out[count] = cell;
            count++;
        }
    }
    return count;
}

struct nav_mapper_grid nav_grid_view_cells(struct nav_grid g)
{
    struct view_bounds b = view_bounds(g);
    if (b.from[0] >= b.until[0])
        return (struct nav_mapper_grid){.cell = NAV_GRID_CELL_M};
    return (struct nav_mapper_grid){.x = (b.from[0] - WHOLE / 2) * NAV_GRID_CELL_M,
                                    .y = (b.from[1] - WHOLE / 2) * NAV_GRID_CELL_M,
                                    .cell = NAV_GRID_CELL_M,
                                    .columns = b.until[0] - b.from[0],
                                    .rows = b.until[1] - b.from[1]};
}

void nav_grid_view_occupancy(struct nav_grid g, float *out)
{
    struct view_bounds b = view_bounds(g);
    for (int row = b.from[1]; row < b.until[1]; row++) {
        for (int column = b.from[0]; column < b.until[0]; column++) {
            const struct nav_grid_cell *cell = nav_grid_cell_at(g.pool, g.map, column, row);
            *out++ = (cell->hits + 0.5F) / (cell->hits + cell->passed + 1.0F);
        }
    }
}
