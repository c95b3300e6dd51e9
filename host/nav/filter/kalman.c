/* Filters that hold one Gaussian: an extended Kalman filter, which corrects it by scalar sightings, and dead reckoning,
 * which corrects nothing.
 *
 * Ranges have a derivative except at corners; textures have none, and only the borders they reveal are used (see
 * borders.h), as landmark filters do with lines. Data association is the nearest border or surface within a gate. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "borders.h"
#include "filter.h"
#include "gaussian.h"
#include "likelihood.h"
#include "mixture.h"

static const double GATE = 9.0;        /* squared standard deviations */
static const double ALONG_LEAST = 0.3; /* a crossing at a flatter angle than this cosine says too little */

struct nav_kalman_sighting {
    int ray;              /* a contact along this object whisker; -1: a border crossed */
    struct nav_tip point; /* crossing: robot frame */
    bool upright;         /* crossing: the border is a line x = z, else y = z */
    double z, variance;   /* m, m^2; "no contact" is a distance of the whisker's length, looked up no further */
    double reach;         /* contact: ranges are looked up to here, m */
    bool normal;          /* contact: how the face lies, and not how far away it is: */
    double reported;      /* its direction as reported, rad; z is 0, and so is reach: what is not known agrees */
};

/* A sighting about the belief, to first and second moments: what is expected, its variance without the sighting's own,
 * and its covariance with x, y, theta. */
struct nav_kalman_linear {
    double expected, variance, cross[3];
};

struct nav_kalman {
    const struct nav_problem *problem;
    struct nav_gaussian belief;
    struct nav_likelihood *likelihood; /* for the texture models; NULL: nothing is corrected */
    double *weight;                    /* [whiskers] of the row, object whiskers left out */
    struct nav_borders borders;
    long evaluations; /* expected observations worked out for the last row */
};

static void kalman_destroy(void *self)
{
    struct nav_kalman *k = self;
    nav_likelihood_free(k->likelihood);
    nav_borders_free(&k->borders);
    free(k->weight);
    free(k);
}

static void *kalman_create_none(const struct nav_problem *problem)
{
    struct nav_kalman *k = calloc(1, sizeof *k);
    if (k)
        *k = (struct nav_kalman){.problem = problem, .belief = nav_mixture_prior(problem)};
    return k;
}

static void *kalman_create_extended(const struct nav_problem *problem)
{
    struct nav_kalman *k = kalman_create_none(problem);
    if (!k)
        return NULL;
    k->likelihood = nav_likelihood_new(&problem->arena, &problem->robot, &problem->settings, 0.0);
    k->weight = k->likelihood ? calloc((size_t)k->likelihood->whiskers + 1, sizeof *k->weight) : NULL;
    if (nav_borders_init(&k->borders, &problem->arena, &problem->robot) == 0 && k->weight)
        return k;
    kalman_destroy(k);
    return NULL;
}

static void kalman_move(struct nav_kalman *k, struct nav_pose step, const struct nav_noise *noise)
{
    nav_gaussian_move(&k->belief, step, noise);
    nav_borders_move(&k->borders, step);
}

static void kalman_predict(void *self, const struct nav_motion *motion)
{
    struct nav_kalman *k = self;
    struct nav_noise noise = nav_motion_noise(&k->problem->robot, &k->problem->settings, motion);
    kalman_move(k, motion->step, &noise);
    if (motion->carried) {
        nav_gaussian_carry(&k->belief, &k->problem->arena);
        nav_borders_forget(&k->borders);
    }
}

/* Expected direction of the face that the mean meets, less the reported one, for a robot that is turned otherwise.
 */
static double kalman_turned(const struct nav_kalman *k, const struct nav_kalman_sighting *s, double theta)
{
    const struct nav_likelihood *l = k->likelihood;
    const struct nav_pose *mean = &k->belief.mean;
    const struct nav_place at = {mean->x, mean->y, cos(mean->theta), sin(mean->theta)};
    struct nav_arena near;
    if (!nav_obstacles_near(&l->obstacles, mean->x, mean->y, &near))
        return NAN;
    double met = nav_normal_direction(&l->model[l->sensors.first[2] + s->ray], &near, &at);
    return nav_wrap(met - s->reported) + mean->theta - theta;
}

/* Expected value of a sighting at a pose; not finite when nothing is within reach. */
static double kalman_expect(struct nav_kalman *k, const struct nav_kalman_sighting *s, struct nav_pose pose)
{
    k->evaluations++;
    struct nav_pose at = nav_compose(pose, (struct nav_pose){s->point.x, s->point.y, 0.0});
    if (s->ray < 0)
        return s->upright ? at.x : at.y;
    if (s->normal)
        return kalman_turned(k, s, pose.theta);
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

static struct nav_pose kalman_shifted(struct nav_pose pose, const double d[3])
{
    return (struct nav_pose){pose.x + d[0], pose.y + d[1], pose.theta + d[2]};
}

/* About the mean, by central differences. Not finite at a corner or an edge, where the range jumps. */
static void kalman_linearise(struct nav_kalman *k, const struct nav_kalman_sighting *s, struct nav_kalman_linear *out)
{
    static const double STEP = 1e-4, STEEPEST = 50.0; /* m and rad; m per m or rad */
    const double *p = k->belief.covariance;
    double slope[3];
    *out = (struct nav_kalman_linear){.expected = kalman_expect(k, s, k->belief.mean)};
    for (int a = 0; a < 3; a++) {
        double d[3] = {0.0};
        d[a] = STEP;
        double ahead = kalman_expect(k, s, kalman_shifted(k->belief.mean, d));
        d[a] = -STEP;
        slope[a] = (ahead - kalman_expect(k, s, kalman_shifted(k->belief.mean, d))) / (2.0 * STEP);
        slope[a] = fabs(slope[a]) <= STEEPEST ? slope[a] : (double)NAN;
    }
    for (int a = 0; a < 3; a++) {
        out->cross[a] = p[3 * a] * slope[0] + p[3 * a + 1] * slope[1] + p[3 * a + 2] * slope[2];
        out->variance += slope[a] * out->cross[a];
    }
}

/* Squared standard deviations that a sighting is off by; INFINITY where it cannot be expected. */
static double kalman_badness(struct nav_kalman *k, const struct nav_kalman_sighting *s, struct nav_kalman_linear *l)
{
    kalman_linearise(k, s, l);
    double off = s->z - l->expected, badness = off * off / (l->variance + s->variance);
    return isfinite(l->variance) && isfinite(badness) ? badness : (double)INFINITY;
}

/* Corrects the belief by one sighting unless it is further off than three standard deviations, or the result would be
 * no covariance any more. */
static void kalman_correct(struct nav_kalman *k, const struct nav_kalman_sighting *s)
{
    struct nav_kalman_linear l;
    if (kalman_badness(k, s, &l) > GATE)
        return;
    struct nav_gaussian next = k->belief;
    double gain[3], information[9], variance = l.variance + s->variance;
    for (int a = 0; a < 3; a++)
        gain[a] = l.cross[a] / variance * (s->z - l.expected);
    next.mean = kalman_shifted(next.mean, gain);
    next.mean.theta = nav_wrap(next.mean.theta);
    for (int n = 0; n < 9; n++)
        next.covariance[n] -= l.cross[n / 3] * l.cross[n % 3] / variance;
    if (nav_gaussian_invert(next.covariance, information) && isfinite(next.mean.x + next.mean.y + next.mean.theta))
        k->belief = next;
}

static void kalman_read_range(struct nav_kalman *k, int r, double distance, double weight)
{
    const struct nav_robot *robot = &k->problem->robot;
    double length = robot->ray[r].length, edge = k->problem->settings.radial.edge_m;
    bool contact = isfinite(distance);
    double sigma = contact ? robot->radial_sigma : hypot(robot->radial_sigma, edge);
    double spread = sqrt(k->belief.covariance[0] + k->belief.covariance[4]);
    struct nav_kalman_sighting s = {.ray = r,
                                    .z = contact ? distance : length,
                                    .variance = sigma * sigma / weight,
                                    .reach = contact ? length + 3.0 * spread : length};
    kalman_correct(k, &s);
}

static void kalman_read_normal(struct nav_kalman *k, int r, const double *normal, double weight)
{
    struct nav_kalman_sighting s = {
        .ray = r, .normal = true, .reported = normal[0], .variance = normal[1] * normal[1] / weight};
    kalman_correct(k, &s);
}

/* Texture of tile `column`, `row`, or -1 outside. */
static int kalman_tile(const struct nav_arena *arena, int column, int row)
{
    if (column < 0 || row < 0 || column >= arena->columns || row >= arena->rows)
        return -1;
    return arena->floor[row * arena->columns + column];
}

struct kalman_search {
    const struct nav_crossing *crossing;
    struct nav_pose toward; /* motion of the crossing in the world; theta unused */
    struct nav_kalman_sighting best;
    double badness; /* of the best */
};

/* Whether the line before tile (column, row) is such a border as was crossed, and the likeliest so far. */
static void kalman_consider(struct nav_kalman *k, struct kalman_search *search, bool upright, int column, int row)
{
    const struct nav_arena *arena = &k->problem->arena;
    const struct nav_crossing *crossing = search->crossing;
    double along = upright ? search->toward.x : search->toward.y, sigma = crossing->sigma * fabs(along);
    int below = kalman_tile(arena, column - upright, row - !upright), above = kalman_tile(arena, column, row);
    if (fabs(along) < ALONG_LEAST || (along > 0.0 ? below : above) != crossing->from ||
        (along > 0.0 ? above : below) != crossing->to)
        return;
    struct nav_kalman_sighting s = {.ray = -1,
                                    .point = crossing->point,
                                    .upright = upright,
                                    .z = (upright ? column : row) * arena->tile,
                                    .variance = sigma * sigma};
    struct nav_kalman_linear l;
    double badness = kalman_badness(k, &s, &l);
    if (badness >= search->badness)
        return;
    search->best = s;
    search->badness = badness;
}

static void kalman_read_crossing(struct nav_kalman *k, const struct nav_crossing *crossing)
{
    struct nav_pose mean = k->belief.mean, turn = {0.0, 0.0, mean.theta};
    struct nav_pose at = nav_compose(mean, (struct nav_pose){crossing->point.x, crossing->point.y, 0.0});
    struct kalman_search search = {.crossing = crossing, .badness = GATE};
    search.toward = nav_compose(turn, (struct nav_pose){crossing->toward.x, crossing->toward.y, 0.0});
    double x = at.x / k->problem->arena.tile, y = at.y / k->problem->arena.tile;
    if (!(fabs(x) < 1e6 && fabs(y) < 1e6))
        return;
    for (int near = -1; near <= 1; near++) {
        kalman_consider(k, &search, true, (int)floor(x + 0.5) + near, (int)floor(y));
        kalman_consider(k, &search, false, (int)floor(x), (int)floor(y + 0.5) + near);
    }
    if (search.badness < GATE)
        kalman_correct(k, &search.best);
}

static void kalman_take(struct nav_kalman *k, const struct nav_evidence *evidence)
{
    struct nav_crossing crossing;
    const int *first = k->likelihood->sensors.first; /* texture, distance, normal; other sensors say nothing */
    k->evaluations = 0;
    for (int t = 0; t < first[1]; t++) {
        if (evidence->weight[t] > 0.0 && nav_borders_read(&k->borders, t, k->likelihood->table[t], &crossing))
            kalman_read_crossing(k, &crossing);
    }
    for (int w = first[1]; w < first[2]; w++) {
        if (evidence->weight[w] > 0.0)
            kalman_read_range(k, w - first[1], evidence->reading[w][0], evidence->weight[w]);
    }
    for (int w = first[2]; w < first[3]; w++) {
        if (evidence->weight[w] > 0.0)
            kalman_read_normal(k, w - first[2], evidence->reading[w], evidence->weight[w]);
    }
    nav_borders_row_done(&k->borders);
}

static void kalman_update(void *self, const struct nav_evidence *evidence)
{
    struct nav_kalman *k = self;
    if (!k->likelihood)
        return;
    memcpy(k->weight, evidence->weight, (size_t)k->likelihood->sensors.first[1] * sizeof *k->weight);
    struct nav_evidence own = *evidence;
    own.weight = k->weight;
    nav_likelihood_read(k->likelihood, &own);
    kalman_take(k, evidence);
}

static void kalman_estimate(const void *self, struct nav_estimate *out)
{
    const struct nav_kalman *k = self;
    nav_gaussian_estimate(&k->belief, out);
    out->evaluations = out->distinct = out->touched = k->evaluations;
    out->states = 1;
    out->bytes = sizeof *k + (k->likelihood ? nav_likelihood_bytes(k->likelihood) : 0);
}

static long kalman_components(const void *self, struct nav_component *out, long room)
{
    return nav_gaussian_components(&((const struct nav_kalman *)self)->belief, out, room);
}

#define KALMAN_OPS                                                                                                     \
    .destroy = kalman_destroy, .predict = kalman_predict, .update = kalman_update, .estimate = kalman_estimate,        \
    .components = kalman_components

const struct nav_filter_ops nav_odometry_filter = {.name = "odometry", .create = kalman_create_none, KALMAN_OPS};
const struct nav_filter_ops nav_ekf_filter = {.name = "ekf", .create = kalman_create_extended, KALMAN_OPS};
