/* What a mapper believes of the world, read out. */
#include <math.h>
#include <stdlib.h>

#include "corner.h"
#include "mapper_state.h"

static const double DEEP_M = 0.05, BLUR_M = 0.01; /* of what is solid behind a face; of its surface */

/* The stretch of a face from cell `from` on that was felt; returns the cell after it. */
static int mapper_stretch(const struct nav_particle_map *p, int number, int from, struct nav_mapper_face *out)
{
    const struct nav_face *g = &p->faces.face[number];
    const struct nav_joint *j = &p->joint;
    double low, high;
    int next = nav_face_stretch(g, from, &low, &high);
    double normal = j->mean[g->index], nx = cos(normal), ny = sin(normal), offset = j->mean[g->index + 1];
    double x = g->anchor_x + nx * offset, y = g->anchor_y + ny * offset;
    *out = (struct nav_mapper_face){.x0 = x - ny * low,
                                    .y0 = y + nx * low,
                                    .x1 = x - ny * high,
                                    .y1 = y + nx * high,
                                    .normal = nav_wrap(normal),
                                    .normal_sigma = sqrt(fmax(j->cov[g->index * (j->room + 1)], 0.0)),
                                    .offset_sigma = sqrt(fmax(j->cov[(g->index + 1) * (j->room + 1)], 0.0)),
                                    .hits = g->hits,
                                    .face = number,
                                    .right = g->right};
    return next;
}

long nav_mapper_faces(const struct nav_mapper *m, struct nav_mapper_face *out, long room)
{
    const struct nav_particle_map *p = nav_mapper_best(m);
    long count = 0;
    for (int n = 0; n < p->faces.count; n++) {
        struct nav_mapper_face stretch;
        for (int cell = mapper_stretch(p, n, 0, &stretch); cell > 0; cell = mapper_stretch(p, n, cell, &stretch)) {
            if (count < room)
                out[count] = stretch;
            count++;
        }
    }
    return count;
}

/* How far the face moves at a point, along its normal. */
static struct nav_linear mapper_shift(const struct nav_face *g, const struct nav_corner_line *l, double x, double y)
{
    struct nav_linear form = {.terms = 0};
    nav_linear_add(&form, g->index, l->nx * (g->anchor_y - y) - l->ny * (g->anchor_x - x));
    nav_linear_add(&form, g->index + 1, 1.0);
    return form;
}

/* False: the two make no corner. */
static bool mapper_corner(const struct nav_particle_map *p, int first, int second, struct nav_mapper_corner *out)
{
    const struct nav_face *g = &p->faces.face[first], *h = &p->faces.face[second];
    struct nav_corner corner;
    if (!nav_corner_find(g, h, &p->joint, &corner))
        return false;
    double x = corner.x, y = corner.y;
    struct nav_corner_line a = corner.line[0], b = corner.line[1];
    struct nav_linear of_a = mapper_shift(g, &a, x, y), of_b = mapper_shift(h, &b, x, y),
                      both = nav_linear_sum(&of_a, &of_b);
    double v = nav_joint_variance(&p->joint, &of_a), w = nav_joint_variance(&p->joint, &of_b);
    double cross = 0.5 * (nav_joint_variance(&p->joint, &both) - v - w), scale = 1.0 / (corner.sine * corner.sine);
    *out = (struct nav_mapper_corner){.x = x, .y = y, .face = {first, second}};
    out->xx = scale * (b.ny * b.ny * v - 2.0 * b.ny * a.ny * cross + a.ny * a.ny * w);
    out->xy = scale * (-b.ny * b.nx * v + (b.ny * a.nx + a.ny * b.nx) * cross - a.ny * a.nx * w);
    out->yy = scale * (b.nx * b.nx * v - 2.0 * b.nx * a.nx * cross + a.nx * a.nx * w);
    return true;
}

long nav_mapper_corners(const struct nav_mapper *m, struct nav_mapper_corner *out, long room)
{
    const struct nav_particle_map *p = nav_mapper_best(m);
    struct nav_mapper_corner corner;
    long count = 0;
    for (int a = 0; a < p->faces.count; a++) {
        for (int b = a + 1; b < p->faces.count; b++) {
            if (!mapper_corner(p, a, b, &corner))
                continue;
            if (count < room)
                out[count] = corner;
            count++;
        }
    }
    return count;
}

/* Columns and rows of what is known, faces included. */
static void mapper_known(const struct nav_mapper *m, int from[2], int until[2])
{
    const struct nav_particle_map *p = nav_mapper_best(m);
    struct nav_mapper_face s;
    for (int axis = 0; axis < 2; axis++) {
        from[axis] = m->course.cells.from[axis];
        until[axis] = m->course.cells.until[axis];
    }
    for (int n = 0; n < p->faces.count; n++) {
        for (int cell = mapper_stretch(p, n, 0, &s); cell > 0; cell = mapper_stretch(p, n, cell, &s)) {
            double dx = DEEP_M * cos(s.normal), dy = DEEP_M * sin(s.normal);
            for (int side = 0; side < 2; side++) {
                nav_cells_hold(from, until, s.x0 - side * dx, s.y0 - side * dy);
                nav_cells_hold(from, until, s.x1 - side * dx, s.y1 - side * dy);
            }
        }
    }
}

struct nav_mapper_grid nav_mapper_grid(const struct nav_mapper *m)
{
    int from[2], until[2];
    mapper_known(m, from, until);
    if (from[0] >= until[0])
        return (struct nav_mapper_grid){.cell = NAV_CELLS_M};
    return (struct nav_mapper_grid){.x = (from[0] - NAV_CELLS_SIDE / 2) * NAV_CELLS_M,
                                    .y = (from[1] - NAV_CELLS_SIDE / 2) * NAV_CELLS_M,
                                    .cell = NAV_CELLS_M,
                                    .columns = until[0] - from[0],
                                    .rows = until[1] - from[1]};
}

/* What is behind a stretch of a face is solid, where the body has not stood. exists: probability of the face. */
static void mapper_draw(const struct nav_mapper_face *s, const struct nav_mapper_grid *grid, double exists, float *out)
{
    double length = hypot(s->x1 - s->x0, s->y1 - s->y0), nx = cos(s->normal), ny = sin(s->normal);
    double spread = hypot(hypot(s->offset_sigma, s->normal_sigma * length / 2.0), BLUR_M);
    double step = NAV_CELLS_M / 2.0, ux = length > 0.0 ? (s->x1 - s->x0) / length : 0.0,
           uy = length > 0.0 ? (s->y1 - s->y0) / length : 0.0;
    for (double along = 0.0; along <= length; along += step) {
        for (double deep = -step; deep < DEEP_M; deep += step) {
            int column = (int)floor((s->x0 + along * ux - deep * nx - grid->x) / grid->cell);
            int row = (int)floor((s->y0 + along * uy - deep * ny - grid->y) / grid->cell);
            if (column < 0 || row < 0 || column >= grid->columns || row >= grid->rows)
                continue;
            float *cell = &out[(ptrdiff_t)row * grid->columns + column];
            double middle_x = grid->x + (column + 0.5) * grid->cell, middle_y = grid->y + (row + 0.5) * grid->cell;
            double behind = -(nx * (middle_x - s->x0) + ny * (middle_y - s->y0));
            double solid = exists * 0.5 * erfc(-behind / spread / sqrt(2.0));
            *cell = fmaxf(*cell, (float)solid);
        }
    }
}

void nav_mapper_occupancy(const struct nav_mapper *m, float *out)
{
    const struct nav_particle_map *p = nav_mapper_best(m);
    struct nav_mapper_grid grid = nav_mapper_grid(m);
    struct nav_mapper_face s;
    int column = nav_cells_at(grid.x + grid.cell / 2.0), line = nav_cells_at(grid.y + grid.cell / 2.0);
    for (int row = 0; row < grid.rows; row++) {
        const float *odds = m->course.cells.odds + (ptrdiff_t)(line + row) * NAV_CELLS_SIDE + column;
        for (int n = 0; n < grid.columns; n++)
            out[(ptrdiff_t)row * grid.columns + n] = 1.0F / (1.0F + expf(-odds[n]));
    }
    for (int n = 0; n < p->faces.count; n++) {
        const struct nav_face *g = &p->faces.face[n];
        for (int cell = mapper_stretch(p, n, 0, &s); cell > 0; cell = mapper_stretch(p, n, cell, &s))
            mapper_draw(&s, &grid, g->hits / (g->hits + g->missed), out);
    }
}

struct nav_mapper_lattice nav_mapper_lattice(const struct nav_mapper *m)
{
    const struct nav_particle_map *p = nav_mapper_best(m);
    const struct nav_joint *j = &p->joint;
    const double *mean = j->mean, *cov = j->cov;
    int step = j->room + 1;
    bool known = cov[NAV_JOINT_AXES * step] < NAV_JOINT_AXES_KNOWN;
    struct nav_mapper_lattice out = {.axes = known ? mean[NAV_JOINT_AXES] : (double)NAN};
    if (!p->floor.known)
        return out;
    double c = cos(mean[NAV_JOINT_LATTICE_TURN]), s = sin(mean[NAV_JOINT_LATTICE_TURN]);
    double u = mean[NAV_JOINT_LATTICE_U], v = mean[NAV_JOINT_LATTICE_V];
    out.x = p->floor.x + c * u - s * v;
    out.y = p->floor.y + s * u + c * v;
    out.turn = mean[NAV_JOINT_LATTICE_TURN];
    out.pitch = mean[NAV_JOINT_PITCH];
    out.sigma_m = sqrt(fmax(cov[NAV_JOINT_LATTICE_U * step], cov[NAV_JOINT_LATTICE_V * step]));
    out.sigma_turn = sqrt(cov[NAV_JOINT_LATTICE_TURN * step]);
    out.sigma_pitch = sqrt(cov[NAV_JOINT_PITCH * step]);
    return out;
}

double nav_mapper_tile(const struct nav_mapper *m, int column, int row, int *texture)
{
    return nav_floor_sure(&nav_mapper_best(m)->floor, column, row, texture);
}
