#include "kalman.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double GATE = 9.0;        /* squared standard deviations */
static const double ALONG_LEAST = 0.3; /* a crossing at a flatter angle than this cosine says too little */

struct nav_kalman *nav_kalman_new(const struct nav_problem *problem, nav_linearise *linearise)
{
    struct nav_kalman *k = calloc(1, sizeof *k);
    if (!k)
        return NULL;
    *k = (struct nav_kalman){.problem = problem, .belief = nav_gaussian_prior(problem), .linearise = linearise};
    k->likelihood = nav_likelihood_new(&problem->arena, &problem->robot, &problem->settings, 0.0);
    k->weight = k->likelihood ? calloc((size_t)k->likelihood->whiskers + 1, sizeof *k->weight) : NULL;
    if (nav_borders_init(&k->borders, &problem->arena, &problem->robot) || !k->likelihood || !k->weight) {
        nav_kalman_destroy(k);
        return NULL;
    }
    return k;
}

void nav_kalman_destroy(void *self)
{
    struct nav_kalman *k = self;
    nav_likelihood_free(k->likelihood);
    nav_borders_free(&k->borders);
    free(k->weight);
    free(k);
}

void nav_kalman_predict(void *self, const struct nav_motion *motion)
{
    struct nav_kalman *k = self;
    struct nav_noise noise = nav_motion_noise(&k->problem->robot, &k->problem->settings, motion);
    nav_gaussian_move(&k->belief, motion->step, &noise);
    nav_borders_move(&k->borders, motion->step);
}

double nav_kalman_expect(struct nav_kalman *k, const struct nav_sighting *s, struct nav_pose pose)
{
    k->evaluations++;
    struct nav_pose at = nav_compose(pose, (struct nav_pose){s->point.x, s->point.y, 0.0});
    if (s->ray < 0)
        return s->upright ? at.x : at.y;
    const struct nav_ray *ray = &k->problem->robot.ray[s->ray];
    const struct nav_likelihood *l = k->likelihood;
    const struct nav_arena *arena = &k->problem->arena;
    struct nav_arena near;
    if (s->reach <= l->model[l->sensors.first[1] + s->ray].reach) { /* else beyond what the buckets hold */
        if (!nav_obstacles_near(&l->obstacles, pose.x, pose.y, &near))
            return INFINITY;
        arena = &near;
    }
    at = nav_compose(pose, (struct nav_pose){ray->x, ray->y, ray->yaw});
    return nav_arena_range(arena, at.x, at.y, at.theta, s->reach);
}

/* Takes the gain's share of the innovation; refuses a result that is no covariance any more. */
static void apply(struct nav_gaussian *belief, const struct nav_linear *l, double innovation, double variance)
{
    struct nav_gaussian next = *belief;
    double information[9];
    next.mean.x += l->cross[0] / variance * innovation;
    next.mean.y += l->cross[1] / variance * innovation;
    next.mean.theta = nav_wrap(next.mean.theta + l->cross[2] / variance * innovation);
    for (int n = 0; n < 9; n++)
        next.covariance[n] -= l->cross[n / 3] * l->cross[n % 3] / variance;
    if (nav_gaussian_invert(next.covariance, information) && isfinite(next.mean.x + next.mean.y + next.mean.theta))
        *belief = next;
}

void nav_kalman_correct(struct nav_kalman *k, const struct nav_sighting *s)
{
    struct nav_linear l;
    if (!k->linearise(k, s, &l))
        return;
    double innovation = s->z - l.expected, variance = l.variance + s->variance;
    if (innovation * innovation <= GATE * variance)
        apply(&k->belief, &l, innovation, variance);
}

static double pose_sigma(const struct nav_kalman *k)
{
    return sqrt(k->belief.covariance[0] + k->belief.covariance[4]);
}

static void take_radial(struct nav_kalman *k, int r, double distance, double weight)
{
    const struct nav_robot *robot = &k->problem->robot;
    double length = robot->ray[r].length, edge = k->problem->settings.radial.edge_m;
    bool contact = isfinite(distance);
    double sigma = contact ? robot->radial_sigma : hypot(robot->radial_sigma, edge);
    struct nav_sighting s = {.ray = r,
                             .z = contact ? distance : length,
                             .variance = sigma * sigma / weight,
                             .reach = contact ? length + 3.0 * pose_sigma(k) : length};
    nav_kalman_correct(k, &s);
}

/* Texture `column`, `row` of tiles, or -1 outside. */
static int tile(const struct nav_arena *arena, int column, int row)
{
    if (column < 0 || row < 0 || column >= arena->columns || row >= arena->rows)
        return -1;
    return arena->floor[row * arena->columns + column];
}

struct search {
    const struct nav_crossing *crossing;
    struct nav_pose at, toward; /* point and motion of the crossing in the world; theta unused */
    struct nav_sighting best;
    double badness; /* of the best, squared standard deviations */
};

/* Whether the line before tile (column, row) is such a border as was crossed, and the likeliest so far. */
static void consider(struct nav_kalman *k, struct search *search, bool upright, int column, int row)
{
    const struct nav_arena *arena = &k->problem->arena;
    double along = upright ? search->toward.x : search->toward.y;
    int below = tile(arena, column - upright, row - !upright), above = tile(arena, column, row);
    if (fabs(along) < ALONG_LEAST || (along > 0.0 ? below : above) != search->crossing->from ||
        (along > 0.0 ? above : below) != search->crossing->to)
        return;
    double sigma = search->crossing->sigma * fabs(along);
    struct nav_sighting s = {.ray = -1,
                             .point = search->crossing->point,
                             .upright = upright,
                             .z = (upright ? column : row) * arena->tile,
                             .variance = sigma * sigma};
    struct nav_linear l;
    if (!k->linearise(k, &s, &l))
        return;
    double badness = (s.z - l.expected) * (s.z - l.expected) / (l.variance + s.variance);
    if (badness < search->badness) {
        search->best = s;
        search->badness = badness;
    }
}

static void take_crossing(struct nav_kalman *k, const struct nav_crossing *crossing)
{
    const struct nav_arena *arena = &k->problem->arena;
    struct nav_pose mean = k->belief.mean, turn = {0.0, 0.0, mean.theta};
    struct search search = {.crossing = crossing, .badness = GATE};
    search.at = nav_compose(mean, (struct nav_pose){crossing->point.x, crossing->point.y, 0.0});
    search.toward = nav_compose(turn, (struct nav_pose){crossing->toward.x, crossing->toward.y, 0.0});
    double x = search.at.x / arena->tile, y = search.at.y / arena->tile;
    if (!(fabs(x) < 1e6 && fabs(y) < 1e6))
        return;
    for (int near = -1; near <= 1; near++) {
        consider(k, &search, true, (int)floor(x + 0.5) + near, (int)floor(y));
        consider(k, &search, false, (int)floor(x), (int)floor(y + 0.5) + near);
    }
    if (search.badness < GATE)
        nav_kalman_correct(k, &search.best);
}

void nav_kalman_update(void *self, const struct nav_evidence *evidence)
{
    struct nav_kalman *k = self;
    struct nav_crossing crossing;
    k->evaluations = 0;
    const int *first = k->likelihood->sensors.first; /* texture whiskers, object whiskers; other sensors say nothing */
    memcpy(k->weight, evidence->weight, (size_t)first[1] * sizeof *k->weight);
    nav_likelihood_read(k->likelihood, &(struct nav_evidence){evidence->reading, k->weight});
    for (int t = 0; t < first[1]; t++) {
        if (evidence->weight[t] > 0.0 && nav_borders_read(&k->borders, t, k->likelihood->table[t], &crossing))
            take_crossing(k, &crossing);
    }
    for (int w = first[1]; w < first[2]; w++) {
        if (evidence->weight[w] > 0.0)
            take_radial(k, w - first[1], evidence->reading[w][0], evidence->weight[w]);
    }
    nav_borders_row_done(&k->borders);
}

void nav_kalman_estimate(const void *self, struct nav_estimate *out)
{
    const struct nav_kalman *k = self;
    nav_gaussian_estimate(&k->belief, out);
    out->evaluations = out->distinct = out->touched = k->evaluations;
    out->states = 1;
    out->bytes = sizeof *k;
}

long nav_kalman_components(const void *self, struct nav_component *out, long room)
{
    const struct nav_kalman *k = self;
    return nav_gaussian_components(&k->belief, out, room);
}
