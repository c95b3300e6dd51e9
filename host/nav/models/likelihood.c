#include "likelihood.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { CODES_MOST = 256 };
static const double FINEST_STEP_M = 0.001;

static struct nav_model texture_model(const struct nav_arena *arena, const struct nav_settings *settings)
{
    struct nav_model m = {
        .fill = nav_mm_texture, .settings = settings, .values = arena->classes, .codes = arena->classes};
    nav_mm_texture_begin(&m);
    return m;
}

static struct nav_model radial_model(const struct nav_robot *robot, int ray, const struct nav_settings *settings,
                                     double blur_m)
{
    struct nav_model m = {.fill = nav_mm_radial, .settings = settings, .values = 1, .length = robot->ray[ray].length};
    m.sigma = hypot(robot->radial_sigma, blur_m);
    m.edge = hypot(settings->radial_edge_m, blur_m);
    double reach = m.length + 3.0 * m.edge;
    m.step = fmax(fmax(FINEST_STEP_M, m.sigma / 4.0), reach / (CODES_MOST - 2));
    m.codes = (int)ceil(reach / m.step) + 1;
    return m;
}

static int make_tables(struct nav_likelihood *l)
{
    for (int w = 0; w < l->whiskers; w++) {
        size_t codes = (size_t)l->model[w].codes;
        l->table[w] = calloc(codes, sizeof **l->table);
        l->ratio[w] = calloc(codes, sizeof **l->ratio);
        if (!l->table[w] || !l->ratio[w] || nav_trust_init(&l->trust[w], (int)codes))
            return -1;
        if (w < l->tips)
            continue;
        l->model[w].noticed = calloc(codes, sizeof *l->model[w].noticed);
        if (!l->model[w].noticed)
            return -1;
        nav_mm_radial_begin(&l->model[w]);
    }
    return 0;
}

struct nav_likelihood *nav_likelihood_new(const struct nav_arena *arena, const struct nav_robot *robot,
                                          const struct nav_settings *settings, double blur_m)
{
    struct nav_likelihood *l = calloc(1, sizeof *l);
    if (!l)
        return NULL;
    l->tips = robot->tips;
    l->whiskers = robot->tips + robot->rays;
    l->model = calloc((size_t)l->whiskers + 1, sizeof *l->model);
    l->table = calloc((size_t)l->whiskers + 1, sizeof *l->table);
    l->ratio = calloc((size_t)l->whiskers + 1, sizeof *l->ratio);
    l->weight = calloc((size_t)l->whiskers + 1, sizeof *l->weight);
    l->trust = calloc((size_t)l->whiskers + 1, sizeof *l->trust);
    for (int w = 0; l->model && w < l->whiskers; w++)
        l->model[w] = w < l->tips ? texture_model(arena, settings) : radial_model(robot, w - l->tips, settings, blur_m);
    if (!l->model || !l->table || !l->ratio || !l->weight || !l->trust || make_tables(l)) {
        nav_likelihood_free(l);
        return NULL;
    }
    return l;
}

void nav_likelihood_free(struct nav_likelihood *l)
{
    if (!l)
        return;
    for (int w = 0; w < l->whiskers; w++) {
        free(l->table ? l->table[w] : NULL);
        free(l->ratio ? l->ratio[w] : NULL);
        if (l->trust)
            nav_trust_free(&l->trust[w]);
        if (l->model)
            free(l->model[w].noticed);
    }
    free(l->table);
    free(l->ratio);
    free(l->trust);
    free(l->weight);
    free(l->model);
    free(l);
}

static void read_whisker(struct nav_likelihood *l, int w, const double *reading)
{
    struct nav_model *model = &l->model[w];
    double trust = l->trust[w].working, *ratio = l->ratio[w];
    if (w < l->tips)
        nav_mm_texture_watch(model, reading);
    model->fill(model, reading, ratio);
    for (int k = 0; k < model->codes; k++)
        l->table[w][k] = (float)(l->weight[w] * log(trust * ratio[k] + 1.0 - trust));
}

void nav_likelihood_read(struct nav_likelihood *l, const struct nav_evidence *evidence)
{
    for (int w = 0; w < l->whiskers; w++) {
        l->weight[w] = evidence->weight[w];
        if (l->weight[w] > 0.0)
            read_whisker(l, w, evidence->reading[w]);
        else
            memset(l->table[w], 0, (size_t)l->model[w].codes * sizeof **l->table);
    }
}

uint8_t nav_likelihood_range_code(const struct nav_model *model, double range)
{
    double code = range / model->step;
    return (uint8_t)(code < model->codes - 1 ? (int)code : model->codes - 1);
}

void nav_likelihood_expect(const struct nav_likelihood *l, const struct nav_arena *arena, const struct nav_robot *robot,
                           struct nav_pose pose, uint8_t *codes)
{
    double c = cos(pose.theta), s = sin(pose.theta);
    for (int w = 0; w < robot->tips; w++) {
        const struct nav_tip *tip = &robot->tip[w];
        codes[w] =
            (uint8_t)nav_arena_texture(arena, pose.x + c * tip->x - s * tip->y, pose.y + s * tip->x + c * tip->y);
    }
    for (int r = 0; r < robot->rays; r++) {
        const struct nav_ray *ray = &robot->ray[r];
        const struct nav_model *model = &l->model[l->tips + r];
        double reach = (model->codes - 1) * model->step;
        codes[l->tips + r] = nav_likelihood_range_code(model, nav_arena_range(arena, pose.x + c * ray->x - s * ray->y,
                                                                              pose.y + s * ray->x + c * ray->y,
                                                                              pose.theta + ray->yaw, reach));
    }
}

float nav_likelihood_of(const struct nav_likelihood *l, const uint8_t *codes)
{
    float sum = 0.0f;
    for (int w = 0; w < l->whiskers; w++)
        sum += l->table[w][codes[w]];
    return sum;
}
