#include "filter.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "intake.h"
#include "mixture.h"

static const struct nav_filter_ops *const FILTERS[] = {&nav_odometry_filter, &nav_ekf_filter,
                                                       &nav_foveal_filter,   &nav_grid_filter,
                                                       &nav_particle_filter, &nav_adaptive_filter};

#define COUNT ((int)(sizeof FILTERS / sizeof FILTERS[0]))

struct nav_filter {
    const struct nav_filter_ops *ops;
    struct nav_problem *problem; /* its arrays are the filter's own */
    struct nav_intake intake;
    void *self;
};

const char *nav_filter_name(int index)
{
    return index >= 0 && index < COUNT ? FILTERS[index]->name : NULL;
}

static const struct nav_filter_ops *filter_find(const char *name)
{
    for (int i = 0; i < COUNT; i++) {
        if (strcmp(FILTERS[i]->name, name) == 0)
            return FILTERS[i];
    }
    return NULL;
}

static void *filter_copy(const void *from, int count, size_t size)
{
    void *to = calloc((size_t)count + 1, size);
    if (to && count > 0)
        memcpy(to, from, (size_t)count * size);
    return to;
}

/* Mean and deviations become the mixture's, for callers that want one place. */
static int filter_own_prior(struct nav_prior *prior)
{
    if (!nav_mixture_given(prior)) {
        prior->component = NULL;
        prior->components = 0;
        return 0;
    }
    struct nav_component *component = malloc((size_t)prior->components * sizeof *component);
    if (!component)
        return -1;
    memcpy(component, prior->component, (size_t)prior->components * sizeof *component);
    nav_mixture_normalise(component, prior->components);
    prior->component = component;
    struct nav_gaussian g = nav_mixture_gaussian(prior);
    prior->mean = g.mean;
    for (int i = 0; i < 3; i++)
        prior->sigma[i] = sqrt(g.covariance[4 * i]);
    return 0;
}

static int filter_own(struct nav_problem *p)
{
    int prior = filter_own_prior(&p->prior);
    if (prior)
        p->prior.component = NULL;
    p->arena.floor = filter_copy(p->arena.floor, p->arena.rows * p->arena.columns, sizeof *p->arena.floor);
    p->arena.box = filter_copy(p->arena.box, p->arena.boxes, sizeof *p->arena.box);
    p->robot.tip = filter_copy(p->robot.tip, p->robot.tips, sizeof *p->robot.tip);
    p->robot.ray = filter_copy(p->robot.ray, p->robot.rays, sizeof *p->robot.ray);
    p->robot.sensor = filter_copy(p->robot.sensor, p->robot.sensors, sizeof *p->robot.sensor);
    return !prior && p->arena.floor && p->arena.box && p->robot.tip && p->robot.ray && p->robot.sensor ? 0 : -1;
}

struct nav_filter *nav_filter_new(const char *name, const struct nav_problem *problem)
{
    const struct nav_filter_ops *ops = filter_find(name);
    long which;
    if (!ops || nav_prior_fault(&problem->arena, &problem->prior, &which))
        return NULL;
    struct nav_filter *f = calloc(1, sizeof *f);
    if (!f)
        return NULL;
    f->ops = ops;
    f->problem = malloc(sizeof *f->problem);
    if (!f->problem) {
        free(f);
        return NULL;
    }
    *f->problem = *problem;
    if (filter_own(f->problem) || nav_intake_init(&f->intake, f->problem) || !(f->self = ops->create(f->problem))) {
        nav_filter_free(f);
        return NULL;
    }
    return f;
}

void nav_filter_free(struct nav_filter *f)
{
    if (!f)
        return;
    if (f->self)
        f->ops->destroy(f->self);
    nav_intake_free(&f->intake);
    free((void *)f->problem->arena.floor);
    free((void *)f->problem->arena.box);
    free((void *)f->problem->robot.tip);
    free((void *)f->problem->robot.ray);
    free((void *)f->problem->robot.sensor);
    free((void *)f->problem->prior.component);
    free(f->problem);
    free(f);
}

const char *nav_filter_reset(struct nav_filter *f, const struct nav_prior *prior)
{
    long which;
    const char *fault = nav_prior_fault(&f->problem->arena, prior, &which);
    if (fault)
        return fault;
    struct nav_problem problem = *f->problem;
    problem.prior = *prior;
    struct nav_filter *fresh = nav_filter_new(f->ops->name, &problem);
    if (!fresh)
        return "there is no memory for it";
    struct nav_filter old = *f;
    *f = *fresh;
    *fresh = old;
    nav_filter_free(fresh);
    return NULL;
}

void nav_filter_step(struct nav_filter *f, const struct nav_row *row, struct nav_estimate *estimate)
{
    struct nav_motion motion;
    struct nav_evidence evidence;
    bool news = nav_intake_take(&f->intake, row, &motion, &evidence);
    f->ops->predict(f->self, &motion);
    if (news)
        f->ops->update(f->self, &evidence);
    *estimate = (struct nav_estimate){.evaluations = 0};
    f->ops->estimate(f->self, estimate);
    if (!news)
        estimate->evaluations = estimate->distinct = 0;
}

long nav_filter_components(const struct nav_filter *f, struct nav_component *out, long room)
{
    return f->ops->components(f->self, out, room);
}

struct nav_resolution nav_filter_resolution(const struct nav_filter *f)
{
    return f->ops->resolution ? f->ops->resolution(f->self) : (struct nav_resolution){.m = 0.0};
}

uint64_t nav_filter_bad_cells(const struct nav_filter *f)
{
    return f->intake.bad_cells;
}

uint64_t nav_filter_bad_rows(const struct nav_filter *f)
{
    return f->intake.bad_rows;
}
