#include "planner.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "information.h"

enum { PLANNER_MOST = NAV_PLANNER_HYPOTHESES_MOST, PLANNER_WHISKERS_MOST = 64, PLANNER_CELLS_MOST = 1 << 28 };

static const double PLANNER_CIRCLE = 6.283185307179586;
static const double PLANNER_AGAIN_M = 0.05, PLANNER_AGAIN_RAD = 0.2617993877991494; /* half of a step */
/* Distances are foretold in steps of so much; two that differ by two steps or less are taken for one: a belief's poses
 * are no more exact than that. */
static const double PLANNER_REACH_M = 0.01;
static const uint8_t PLANNER_REACH_SLACK = 2;
static const double PLANNER_SECONDS_LEAST = 1e-6;

/* Hypotheses on their way along one path after another. */
struct planner_state {
    double x[PLANNER_MOST], y[PLANNER_MOST], turn[PLANNER_MOST], seconds[PLANNER_MOST];
    uint8_t apart[PLANNER_MOST * PLANNER_MOST];
};

/* An object whisker, robot's frame. */
struct planner_ray {
    double x, y, c, s, length;
    double far; /* farthest that it reaches from the robot's middle, m */
};

/* Of a step of a path, by what the robot knows of late. */
struct planner_seen {
    bool fresh; /* nothing was read there */
    bool open;  /* nothing that was met is in the way of it */
};

/* Where a path may end, and what it is worth up to there. */
struct planner_end {
    int path, steps;
    double bits, seconds, passed;
};

struct nav_planner {
    struct nav_planner_ground ground;
    struct nav_planner_options options;
    struct nav_robot robot;
    struct nav_tip *tip;
    struct planner_ray *ray;
    int paths, ends;
    struct nav_planner_path *path;
    struct planner_end *end;   /* [ends] */
    struct planner_seen *seen; /* [ends], path by path */
    int n, first, last;        /* hypotheses, and those taken to be true in turn */
    double open_bits;          /* entropy of the place */
    long spent;
    float share[NAV_INFORMATION_LEVELS];
    struct planner_state start, base, way;
    double c[PLANNER_MOST], s[PLANNER_MOST]; /* of the headings where a path begins */
    double turn_c, turn_s;                   /* of the present step's turn */
    uint8_t stopped[PLANNER_MOST];
    uint8_t same[PLANNER_MOST * PLANNER_MOST];
    uint8_t (*code)[PLANNER_MOST]; /* [tips + rays] */
};

static bool planner_refuses(const struct nav_planner_ground *ground, const struct nav_robot *robot,
                            const struct nav_planner_path *path, int paths)
{
    if (robot->tips + robot->rays > PLANNER_WHISKERS_MOST || !(ground->cell > 0.0) || ground->rows < 1 ||
        ground->columns < 1 || (double)ground->rows * ground->columns > PLANNER_CELLS_MOST)
        return true;
    for (int p = 0; p < paths; p++) {
        if (path[p].count < 1 || path[p].count > NAV_PLANNER_STEPS_MOST)
            return true;
    }
    return paths < 1;
}

static void planner_set_robot(struct nav_planner *p, const struct nav_robot *robot)
{
    p->robot = *robot;
    for (int t = 0; t < robot->tips; t++)
        p->tip[t] = robot->tip[t];
    for (int r = 0; r < robot->rays; r++) {
        const struct nav_ray *ray = &robot->ray[r];
        double c = cos(ray->yaw), s = sin(ray->yaw);
        double far = fmax(hypot(ray->x, ray->y), hypot(ray->x + ray->length * c, ray->y + ray->length * s));
        p->ray[r] = (struct planner_ray){ray->x, ray->y, c, s, ray->length, far};
    }
}

struct nav_planner *nav_planner_new(const struct nav_planner_ground *ground, const struct nav_robot *robot,
                                    const struct nav_planner_path *path, int paths,
                                    const struct nav_planner_options *options)
{
    if (planner_refuses(ground, robot, path, paths))
        return NULL;
    struct nav_planner *p = calloc(1, sizeof *p);
    if (!p)
        return NULL;
    p->ground = *ground;
    p->options = *options;
    p->paths = paths;
    for (int k = 0; k < paths; k++)
        p->ends += path[k].count;
    p->end = calloc((size_t)p->ends, sizeof *p->end);
    p->seen = calloc((size_t)p->ends, sizeof *p->seen);
    p->path = calloc((size_t)paths, sizeof *p->path);
    p->tip = calloc((size_t)robot->tips + 1, sizeof *p->tip);
    p->ray = calloc((size_t)robot->rays + 1, sizeof *p->ray);
    p->code = calloc((size_t)(robot->tips + robot->rays) + 1, sizeof *p->code);
    if (!p->end || !p->seen || !p->path || !p->tip || !p->ray || !p->code) {
        nav_planner_free(p);
        return NULL;
    }
    memcpy(p->path, path, (size_t)paths * sizeof *path);
    planner_set_robot(p, robot);
    nav_information_shares(p->share);
    return p;
}

void nav_planner_free(struct nav_planner *p)
{
    if (p) {
        free(p->end);
        free(p->seen);
        free(p->path);
        free(p->tip);
        free(p->ray);
        free(p->code);
    }
    free(p);
}

static uint8_t planner_units(double nats)
{
    double units = nearbyint(nats * NAV_INFORMATION_PER_NAT);
    return (uint8_t)(units < 0.0 ? 0.0 : units > 255.0 ? 255.0 : units);
}

/* Number of the cell at (x, y), or -1 beyond the ground. */
static long planner_cell(const struct nav_planner_ground *g, double x, double y)
{
    double column = (x - g->x) / g->cell, row = (y - g->y) / g->cell;
    if (!(column >= 0.0 && column < g->columns && row >= 0.0 && row < g->rows))
        return -1;
    return (long)row * g->columns + (long)column;
}

/* m from there to what is solid, to a cell. */
static double planner_clear(const struct nav_planner_ground *g, double x, double y)
{
    long cell = planner_cell(g, x, y);
    return cell < 0 ? 0.0 : (double)g->clear[cell];
}

/* Steps of PLANNER_REACH_M along a whisker to what is solid, by steps that are as long as nothing is near. */
static uint8_t planner_reach(const struct nav_planner *p, const struct planner_ray *ray, double x, double y, double c,
                             double s)
{
    double along = 0.0, from_x = x + c * ray->x - s * ray->y, from_y = y + s * ray->x + c * ray->y;
    double way_x = c * ray->c - s * ray->s, way_y = s * ray->c + c * ray->s;
    while (along < ray->length) {
        double clear = planner_clear(&p->ground, from_x + along * way_x, from_y + along * way_y);
        if (clear < p->ground.cell)
            break;
        along += clear;
    }
    return (uint8_t)fmin(fmin(along, ray->length + PLANNER_REACH_M) / PLANNER_REACH_M, 254.0);
}

static uint8_t planner_free_code(const struct planner_ray *ray)
{
    return (uint8_t)fmin((ray->length + PLANNER_REACH_M) / PLANNER_REACH_M, 254.0);
}

/* What the object whiskers of hypothesis i would meet at a pose; whether any does. */
static bool planner_feel(struct nav_planner *p, int i, double x, double y, double c, double s, double clear)
{
    bool touches = false;
    for (int r = 0; r < p->robot.rays; r++) {
        const struct planner_ray *ray = &p->ray[r];
        uint8_t none = planner_free_code(ray);
        uint8_t code = clear > ray->far + p->ground.cell ? none : planner_reach(p, ray, x, y, c, s);
        p->code[p->robot.tips + r][i] = code;
        touches = touches || code < none;
    }
    return touches;
}

static void planner_sweep(struct nav_planner *p, int i, double x, double y, double c, double s)
{
    for (int t = 0; t < p->robot.tips; t++) {
        const struct nav_tip *tip = &p->tip[t];
        long cell = planner_cell(&p->ground, x + c * tip->x - s * tip->y, y + s * tip->x + c * tip->y);
        p->code[t][i] = cell < 0 ? (uint8_t)NAV_PLANNER_NOTHING : p->ground.texture[cell];
    }
}

static void planner_read_nothing(struct nav_planner *p, int i, int first)
{
    for (int w = first; w < p->robot.tips + p->robot.rays; w++)
        p->code[w][i] = NAV_PLANNER_NOTHING;
}

/* Takes a hypothesis to the end of a step, or stops it, and notes what it reads there. */
static void planner_move(struct nav_planner *p, int i, const struct nav_planner_step *step)
{
    const struct planner_state *base = &p->base;
    struct planner_state *way = &p->way;
    double x = base->x[i] + p->c[i] * step->x - p->s[i] * step->y;
    double y = base->y[i] + p->s[i] * step->x + p->c[i] * step->y;
    double c = p->c[i] * p->turn_c - p->s[i] * p->turn_s, s = p->s[i] * p->turn_c + p->c[i] * p->turn_s;
    double clear = planner_clear(&p->ground, x, y);
    bool blocked = clear < p->robot.body_radius && !step->turns;
    way->seconds[i] += step->seconds;
    if (blocked) {
        planner_read_nothing(p, i, 0);
    } else {
        way->x[i] = x;
        way->y[i] = y;
        way->turn[i] = base->turn[i] + step->turn;
        bool touches = planner_feel(p, i, x, y, c, s, clear);
        blocked = touches && p->options.touch_stops;
        planner_sweep(p, i, x, y, c, s);
        if (blocked && step->turns)
            planner_read_nothing(p, i, 0);
    }
    p->stopped[i] = blocked;
    way->seconds[i] += blocked ? p->options.contact_s : 0.0;
}

static void planner_step(struct nav_planner *p, const struct nav_planner_step *step, bool fresh)
{
    int whiskers = p->robot.tips + p->robot.rays, differs;
    p->turn_c = cos(step->turn);
    p->turn_s = sin(step->turn);
    for (int i = 0; i < p->n; i++) {
        if (p->stopped[i])
            planner_read_nothing(p, i, 0);
        else
            planner_move(p, i, step);
    }
    differs = nav_information_refute(p->way.apart, p->n, PLANNER_MOST, p->stopped, planner_units(p->options.stop_nats));
    for (int w = 0; fresh && w < whiskers; w++) {
        bool tip = w < p->robot.tips;
        differs += nav_information_differ(p->way.apart, p->n, PLANNER_MOST, p->code[w], tip ? 0 : PLANNER_REACH_SLACK,
                                          planner_units(tip ? step->texture_nats : step->touch_nats));
    }
    p->spent += (long)differs * p->n * p->n;
}

/* Begins a path from where the hypotheses of `from` are. */
static void planner_begin(struct nav_planner *p, const struct planner_state *from)
{
    if (from != &p->base)
        p->base = *from;
    p->way = p->base;
    memset(p->stopped, 0, sizeof p->stopped);
    for (int i = 0; i < p->n; i++) {
        p->c[i] = cos(p->base.turn[i]);
        p->s[i] = sin(p->base.turn[i]);
    }
}

/* Mean over those taken to be true. */
static double planner_seconds(const struct nav_planner *p)
{
    double seconds = 0.0;
    for (int i = p->first; i < p->last; i++)
        seconds += p->way.seconds[i];
    return fmax(seconds / (p->last - p->first), PLANNER_SECONDS_LEAST);
}

static double planner_bits(struct nav_planner *p)
{
    p->spent += (long)p->n * (p->last - p->first);
    return nav_information_bits(p->way.apart, p->same, p->n, PLANNER_MOST, p->first, p->last, p->share);
}

static double planner_passed(const struct nav_planner *p)
{
    double stopped = 0.0;
    for (int i = 0; i < p->n; i++)
        stopped += p->stopped[i];
    return 1.0 - stopped / p->n;
}

static double planner_rate(const struct planner_end *end)
{
    return end->bits / end->seconds;
}

static bool planner_may_go_on(const struct nav_planner *p)
{
    return p->options.budget <= 0 || p->spent < p->options.budget;
}

/* Follows every path from `from`, as far as the entropy left may make it better than `best` (bits per second). out:
 * NULL, or room for all ends looked at; returns how many there are; *best is that of the best. */
static int planner_follow(struct nav_planner *p, const struct planner_state *from, struct planner_end *out,
                          double *best)
{
    int found = 0;
    const struct planner_seen *seen = p->seen;
    bool first = from == &p->start;
    planner_begin(p, from);
    for (int k = 0; k < p->paths && planner_may_go_on(p); seen += p->path[k++].count) {
        if (k > 0) {
            p->way = p->base;
            memset(p->stopped, 0, sizeof p->stopped);
        }
        for (int n = 0; n < p->path[k].count && planner_may_go_on(p) && (!first || seen[n].open); n++) {
            planner_step(p, &p->path[k].step[n], !first || seen[n].fresh);
            double seconds = planner_seconds(p);
            if (p->open_bits <= *best * seconds)
                break; /* no end further on is better, for it takes longer and yields no more than all */
            if (!p->path[k].step[n].ends)
                continue;
            struct planner_end end = {k, n + 1, planner_bits(p), seconds, planner_passed(p)};
            if (end.bits >= p->options.floor_bits && planner_rate(&end) > *best)
                *best = planner_rate(&end);
            if (out)
                out[found] = end;
            found++;
        }
    }
    return found;
}

/* Goes along a path as far as an end. */
static void planner_go(struct nav_planner *p, const struct planner_end *end)
{
    const struct planner_seen *seen = p->seen;
    for (int k = 0; k < end->path; k++)
        seen += p->path[k].count;
    planner_begin(p, &p->start);
    for (int n = 0; n < end->steps; n++)
        planner_step(p, &p->path[end->path].step[n], seen[n].fresh);
}

/* Puts the best of the ends from number `first` on at its place; of equal ones, the one that was found first. */
static void planner_put_best(struct planner_end *end, int first, int count)
{
    int best = first;
    for (int k = first + 1; k < count; k++)
        best = planner_rate(&end[k]) > planner_rate(&end[best]) ? k : best;
    struct planner_end chosen = end[best];
    memmove(&end[first + 1], &end[first], (size_t)(best - first) * sizeof *end);
    end[first] = chosen;
}

static void planner_set(struct nav_planner *p, const double *poses, int n, int truth)
{
    p->n = n;
    p->first = truth < 0 ? 0 : truth;
    p->last = truth < 0 ? n : truth + 1;
    p->spent = 0;
    memset(&p->start, 0, sizeof p->start);
    for (int i = 0; i < n; i++) {
        p->start.x[i] = poses[3 * i];
        p->start.y[i] = poses[3 * i + 1];
        p->start.turn[i] = poses[3 * i + 2];
    }
    p->open_bits = 0.0;
    for (int i = 0; i < n; i++) {
        int held = 0;
        for (int j = 0; j < n; j++) {
            double x = p->start.x[i] - p->start.x[j], y = p->start.y[i] - p->start.y[j];
            double turn = remainder(p->start.turn[i] - p->start.turn[j], PLANNER_CIRCLE);
            p->same[i * PLANNER_MOST + j] = hypot(x, y) < p->options.place_m && fabs(turn) < p->options.place_rad;
            held += p->same[i * PLANNER_MOST + j];
        }
        if (i >= p->first && i < p->last)
            p->open_bits += log2((double)n / held) / (p->last - p->first);
    }
}

static bool planner_in_way(const struct nav_planner *p, const struct nav_planner_past *past,
                           const struct nav_planner_step *step)
{
    double ahead_x = cos(step->turn), ahead_y = sin(step->turn);
    for (int k = 0; k < past->met && !step->turns; k++) {
        double x = past->thing[2 * k] - step->x, y = past->thing[2 * k + 1] - step->y;
        if (x * x + y * y < p->options.clear_m * p->options.clear_m && x * ahead_x + y * ahead_y > 0.0)
            return true;
    }
    return false;
}

static bool planner_been(const struct nav_planner_past *past, const struct nav_planner_step *step)
{
    for (int k = 0; k < past->been; k++) {
        const double *pose = past->pose + 3 * k;
        if (fabs(pose[0] - step->x) < PLANNER_AGAIN_M && fabs(pose[1] - step->y) < PLANNER_AGAIN_M &&
            fabs(remainder(pose[2] - step->turn, PLANNER_CIRCLE)) < PLANNER_AGAIN_RAD)
            return true;
    }
    return false;
}

/* Notes what is known of every step; whether some drive is open. */
static bool planner_see(struct nav_planner *p, const struct nav_planner_past *past)
{
    struct planner_seen *seen = p->seen;
    bool any = false;
    for (int k = 0; k < p->paths; k++) {
        bool open = true;
        for (int n = 0; n < p->path[k].count; n++, seen++) {
            const struct nav_planner_step *step = &p->path[k].step[n];
            open = open && !planner_in_way(p, past, step);
            *seen = (struct planner_seen){!planner_been(past, step), open};
            any = any || (seen->open && !step->turns);
        }
    }
    return any;
}

/* Of the best ends, the one whose path with the best second path after it has most bits per second of both. */
static const struct planner_end *planner_with_second(struct nav_planner *p, int choices)
{
    const struct planner_end *chosen = &p->end[0];
    double best = planner_rate(chosen);
    for (int k = 0; k < choices && k < p->options.after && planner_may_go_on(p); k++) {
        double both = best;
        planner_put_best(p->end, k, choices);
        planner_go(p, &p->end[k]);
        p->base = p->way;
        planner_follow(p, &p->base, NULL, &both);
        if (both > best) {
            best = both;
            chosen = &p->end[k];
        }
    }
    return chosen;
}

void nav_planner_plan(struct nav_planner *p, const double *poses, int n, int truth, const struct nav_planner_past *past,
                      struct nav_planner_plan *out)
{
    *out = (struct nav_planner_plan){.path = -1};
    if (n < 1 || n > PLANNER_MOST || truth >= n)
        return;
    planner_set(p, poses, n, truth);
    out->shut_in = !planner_see(p, past);
    if (out->shut_in)
        return;
    double best = 0.0;
    int found = planner_follow(p, &p->start, p->end, &best), choices = 0;
    for (int k = 0; k < found; k++) {
        if (p->end[k].bits >= p->options.floor_bits)
            p->end[choices++] = p->end[k];
    }
    if (choices > 0) {
        planner_put_best(p->end, 0, choices);
        const struct planner_end *chosen = planner_with_second(p, choices);
        out->path = chosen->path;
        out->steps = chosen->steps;
        out->bits = chosen->bits;
        out->seconds = chosen->seconds;
        out->passed = chosen->passed;
    }
    out->spent = p->spent;
}

double nav_planner_touch(struct nav_planner *p, const double *poses, int n, int truth, double nats)
{
    if (n < 1 || n > PLANNER_MOST || truth >= n)
        return 0.0;
    planner_set(p, poses, n, truth);
    planner_begin(p, &p->start);
    for (int i = 0; i < n; i++)
        planner_feel(p, i, p->base.x[i], p->base.y[i], p->c[i], p->s[i], 0.0);
    for (int r = 0; r < p->robot.rays; r++)
        nav_information_differ(p->way.apart, n, PLANNER_MOST, p->code[p->robot.tips + r], PLANNER_REACH_SLACK,
                               planner_units(nats));
    return planner_bits(p);
}
