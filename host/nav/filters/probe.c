#include "probe.h"

#include <math.h>
#include <stdlib.h>

static const double CELL_M = 0.02;
static const double CELLS_MOST = 4194304.0;

/* Distance from a point to the nearest box or wall, negative beyond a wall. */
static double clearance_of(const struct nav_arena *arena, double x, double y)
{
    double nearest = fmin(fmin(x, arena->size_x - x), fmin(y, arena->size_y - y));
    for (int i = 0; i < arena->boxes; i++) {
        const struct nav_box *box = &arena->box[i];
        nearest =
            fmin(nearest, hypot(fmax(fmax(box->x0 - x, x - box->x1), 0.0), fmax(fmax(box->y0 - y, y - box->y1), 0.0)));
    }
    return nearest;
}

static int map_clearance(struct nav_probe *p)
{
    const struct nav_arena *arena = p->arena;
    p->cell = fmax(CELL_M, sqrt(arena->size_x * arena->size_y / CELLS_MOST));
    p->per_m = 1.0 / p->cell;
    p->columns = (int)(arena->size_x * p->per_m) + 1;
    p->rows = (int)(arena->size_y * p->per_m) + 1;
    p->clearance = calloc((size_t)p->columns * (size_t)p->rows, sizeof *p->clearance);
    if (!p->clearance)
        return -1;
    for (int n = 0; n < p->columns * p->rows; n++) {
        double x = (n % p->columns + 0.5) * p->cell, y = (n / p->columns + 0.5) * p->cell;
        p->clearance[n] = (float)(clearance_of(arena, x, y) - p->cell * 0.7072);
    }
    return 0;
}

static void aim(struct nav_probe *p)
{
    p->reach = p->robot->body_radius;
    for (int r = 0; r < p->robot->rays; r++) {
        const struct nav_ray *ray = &p->robot->ray[r];
        const struct nav_model *model = &p->likelihood->model[p->robot->tips + r];
        p->bearing[2 * r] = cos(ray->yaw);
        p->bearing[2 * r + 1] = sin(ray->yaw);
        p->reach = fmax(p->reach, hypot(ray->x, ray->y) + (model->codes - 1) * model->step);
    }
}

int nav_probe_init(struct nav_probe *p, const struct nav_problem *problem, double blur_m)
{
    *p = (struct nav_probe){.arena = &problem->arena, .robot = &problem->robot};
    p->likelihood = nav_likelihood_new(&problem->arena, &problem->robot, &problem->settings, blur_m);
    p->bearing = calloc((size_t)problem->robot.rays * 2 + 1, sizeof *p->bearing);
    p->active = calloc((size_t)(problem->robot.tips + problem->robot.rays) + 1, sizeof *p->active);
    if (!p->likelihood || !p->bearing || !p->active || map_clearance(p))
        return -1;
    aim(p);
    return 0;
}

void nav_probe_free(struct nav_probe *p)
{
    nav_likelihood_free(p->likelihood);
    free(p->clearance);
    free(p->bearing);
    free(p->active);
}

static double best_of(const float *table, int codes)
{
    float best = table[0];
    for (int k = 1; k < codes; k++)
        best = table[k] > best ? table[k] : best;
    return (double)best;
}

void nav_probe_read(struct nav_probe *p, const struct nav_evidence *evidence)
{
    const struct nav_likelihood *l = p->likelihood;
    nav_likelihood_read(p->likelihood, evidence);
    p->active_whiskers = p->active_tips = 0;
    p->nothing = p->ceiling = 0.0;
    for (int w = 0; w < l->whiskers; w++) {
        if (!(evidence->weight[w] > 0.0))
            continue;
        p->active[p->active_whiskers++] = w;
        p->ceiling += best_of(l->table[w], l->model[w].codes);
        if (w < l->tips)
            p->active_tips++;
        else
            p->nothing += (double)l->table[w][l->model[w].codes - 1];
    }
}

static double clearance_at(const struct nav_probe *p, double x, double y)
{
    if (!(x > 0.0 && x < p->arena->size_x && y > 0.0 && y < p->arena->size_y))
        return -1.0;
    int column = (int)(x * p->per_m), row = (int)(y * p->per_m);
    return (double)p->clearance[row * p->columns + column];
}

bool nav_probe_free_at(const struct nav_probe *p, double x, double y)
{
    double clear = clearance_at(p, x, y);
    return clear > p->robot->body_radius || (clear > -p->cell && nav_arena_free(p->arena, x, y, p->robot->body_radius));
}

static double at_tips(const struct nav_probe *p, double x, double y, double c, double s)
{
    double sum = 0.0;
    for (int i = 0; i < p->active_tips; i++) {
        int w = p->active[i];
        const struct nav_tip *tip = &p->robot->tip[w];
        sum += (double)p->likelihood
                   ->table[w][nav_arena_texture(p->arena, x + c * tip->x - s * tip->y, y + s * tip->x + c * tip->y)];
    }
    return sum;
}

static double at_rays(const struct nav_probe *p, double x, double y, double c, double s)
{
    double sum = 0.0;
    for (int i = p->active_tips; i < p->active_whiskers; i++) {
        int w = p->active[i], r = w - p->robot->tips;
        const struct nav_ray *ray = &p->robot->ray[r];
        const struct nav_model *model = &p->likelihood->model[w];
        const double *b = p->bearing + 2 * r;
        double range =
            nav_arena_range_along(p->arena, x + c * ray->x - s * ray->y, y + s * ray->x + c * ray->y,
                                  c * b[0] - s * b[1], s * b[0] + c * b[1], (model->codes - 1) * model->step);
        sum += (double)p->likelihood->table[w][nav_likelihood_range_code(model, range)];
    }
    return sum;
}

double nav_probe_at(const struct nav_probe *p, double x, double y, double c, double s)
{
    double clear = clearance_at(p, x, y);
    if (clear > p->reach)
        return at_tips(p, x, y, c, s) + p->nothing;
    if (!(clear > p->robot->body_radius) && !nav_probe_free_at(p, x, y))
        return -INFINITY;
    return at_tips(p, x, y, c, s) + at_rays(p, x, y, c, s);
}

size_t nav_probe_bytes(const struct nav_probe *p)
{
    return sizeof *p + (size_t)p->columns * (size_t)p->rows * sizeof *p->clearance;
}
