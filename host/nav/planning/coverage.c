#include "coverage.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>

#include "pose.h"

enum { COVERAGE_HEADINGS = 8, COVERAGE_NEW = -1, COVERAGE_SETTLED = -2, COVERAGE_NOWHERE = -1 };
#define COVERAGE_HEADING_RAD (2.0 * NAV_PI / COVERAGE_HEADINGS)

static const double COVERAGE_STRAIGHT_RAD = 0.05; /* a smaller turn is made on the way */
static const double COVERAGE_PASSED_LEAST = 1e-4; /* ways that are less likely to be free are not followed */

struct coverage_state {
    float seconds, swept, passed;
    int from;  /* state before it */
    int place; /* in the heap; COVERAGE_NEW or COVERAGE_SETTLED */
};

struct nav_coverage {
    struct nav_coverage_options options;
    double aside[NAV_COVERAGE_ASIDES_MOST];
    int dx[COVERAGE_HEADINGS], dy[COVERAGE_HEADINGS]; /* a step, in cells */
    int cells;
    struct coverage_state *state; /* [cells * HEADINGS] */
    int *heap;                    /* [cells * HEADINGS] states, the fastest first */
    int waiting;
    struct nav_coverage_ground ground;
    int offset[2][NAV_COVERAGE_ASIDES_MOST]; /* of `aside`, in cells, along an edge and along a diagonal */
};

struct nav_coverage *nav_coverage_new(int cells, const struct nav_coverage_options *options)
{
    if (cells < 1 || cells > NAV_COVERAGE_CELLS_MOST || options->asides < 0 ||
        options->asides > NAV_COVERAGE_ASIDES_MOST || !(options->drive_m_s > 0.0) || !(options->turn_rad_s > 0.0))
        return NULL;
    struct nav_coverage *c = calloc(1, sizeof *c);
    if (!c)
        return NULL;
    for (int heading = 0; heading < COVERAGE_HEADINGS; heading++) {
        c->dx[heading] = (int)lround(cos(heading * COVERAGE_HEADING_RAD));
        c->dy[heading] = (int)lround(sin(heading * COVERAGE_HEADING_RAD));
    }
    c->options = *options;
    c->cells = cells;
    for (int k = 0; k < options->asides; k++)
        c->aside[k] = options->aside[k];
    c->options.aside = c->aside;
    c->state = calloc((size_t)cells * COVERAGE_HEADINGS, sizeof *c->state);
    c->heap = calloc((size_t)cells * COVERAGE_HEADINGS, sizeof *c->heap);
    if (!c->state || !c->heap) {
        nav_coverage_free(c);
        return NULL;
    }
    return c;
}

void nav_coverage_free(struct nav_coverage *c)
{
    if (c) {
        free(c->state);
        free(c->heap);
    }
    free(c);
}

static void coverage_put(struct nav_coverage *c, int place, int state)
{
    c->heap[place] = state;
    c->state[state].place = place;
}

static void coverage_rise(struct nav_coverage *c, int place)
{
    int state = c->heap[place];
    while (place > 0 && c->state[c->heap[(place - 1) / 2]].seconds > c->state[state].seconds) {
        coverage_put(c, place, c->heap[(place - 1) / 2]);
        place = (place - 1) / 2;
    }
    coverage_put(c, place, state);
}

static int coverage_pop(struct nav_coverage *c)
{
    int first = c->heap[0], last = c->heap[--c->waiting], place = 0;
    c->state[first].place = COVERAGE_SETTLED;
    while (c->waiting > 0) {
        int child = 2 * place + 1;
        if (child + 1 < c->waiting && c->state[c->heap[child + 1]].seconds < c->state[c->heap[child]].seconds)
            child++;
        if (child >= c->waiting || c->state[c->heap[child]].seconds >= c->state[last].seconds)
            break;
        coverage_put(c, place, c->heap[child]);
        place = child;
    }
    if (c->waiting > 0)
        coverage_put(c, place, last);
    return first;
}

/* Whether a way of so many seconds to a state is the fastest so far. */
static bool coverage_is_faster(const struct nav_coverage *c, int state, float seconds)
{
    const struct coverage_state *s = &c->state[state];
    return s->place != COVERAGE_SETTLED && (s->place == COVERAGE_NEW || seconds < s->seconds);
}

/* A way to a state, taken where it is the fastest so far. */
static void coverage_reach(struct nav_coverage *c, int state, struct coverage_state by)
{
    struct coverage_state *s = &c->state[state];
    if (!coverage_is_faster(c, state, by.seconds))
        return;
    by.place = s->place == COVERAGE_NEW ? c->waiting++ : s->place;
    *s = by;
    c->heap[by.place] = state;
    coverage_rise(c, by.place);
}

/* Fresh floor, m^2, beside the robot's middle in a cell that it drives through with this heading. */
static double coverage_beside(const struct nav_coverage *c, int column, int row, int heading)
{
    const struct nav_coverage_ground *g = &c->ground;
    bool diagonal = heading % 2;
    int fresh = 0, left_x = -c->dy[heading], left_y = c->dx[heading];
    for (int k = 0; k < c->options.asides; k++) {
        int offset = c->offset[diagonal][k], x = column + offset * left_x, y = row + offset * left_y;
        if (x >= 0 && x < g->columns && y >= 0 && y < g->rows)
            fresh += g->fresh[(long)y * g->columns + x];
    }
    return fresh * g->cell * g->cell * (diagonal ? sqrt(2.0) : 1.0);
}

static void coverage_forward(struct nav_coverage *c, int state)
{
    const struct nav_coverage_ground *g = &c->ground;
    const struct coverage_state *s = &c->state[state];
    int heading = state % COVERAGE_HEADINGS, cell = state / COVERAGE_HEADINGS;
    int column = cell % g->columns + c->dx[heading], row = cell / g->columns + c->dy[heading];
    if (column < 0 || column >= g->columns || row < 0 || row >= g->rows)
        return;
    int next = row * g->columns + column;
    double open = (double)g->open[next], passed = (double)s->passed * open;
    double way = g->cell * (heading % 2 ? sqrt(2.0) : 1.0);
    if (!(passed >= COVERAGE_PASSED_LEAST))
        return;
    float seconds = s->seconds + (float)(way / c->options.drive_m_s + (1.0 - open) * c->options.stopped_s);
    next = next * COVERAGE_HEADINGS + heading;
    if (!coverage_is_faster(c, next, seconds))
        return; /* before the floor beside it is counted */
    double swept = passed * coverage_beside(c, column, row, heading);
    coverage_reach(c, next,
                   (struct coverage_state){
                       .seconds = seconds, .swept = s->swept + (float)swept, .passed = (float)passed, .from = state});
}

/* Whether a state was reached by a turn on the spot. */
static bool coverage_turned(const struct nav_coverage *c, int state)
{
    int from = c->state[state].from;
    return from != COVERAGE_NOWHERE && from / COVERAGE_HEADINGS == state / COVERAGE_HEADINGS;
}

static void coverage_turn(struct nav_coverage *c, int state, int by)
{
    struct coverage_state next = c->state[state];
    int cell = state / COVERAGE_HEADINGS, heading = (state + by + COVERAGE_HEADINGS) % COVERAGE_HEADINGS;
    double seconds = COVERAGE_HEADING_RAD / c->options.turn_rad_s;
    next.seconds += (float)(seconds + (coverage_turned(c, state) ? 0.0 : c->options.begin_s));
    next.from = state;
    coverage_reach(c, cell * COVERAGE_HEADINGS + heading, next);
}

/* Every heading in the cell where it stands. False: it is not on the ground. */
static bool coverage_begin(struct nav_coverage *c, double x, double y, double turn)
{
    const struct nav_coverage_ground *g = &c->ground;
    double column = floor((x - g->x) / g->cell), row = floor((y - g->y) / g->cell);
    if (!(column >= 0.0 && column < g->columns && row >= 0.0 && row < g->rows && isfinite(turn)))
        return false;
    for (int heading = 0; heading < COVERAGE_HEADINGS; heading++) {
        double angle = fabs(remainder(heading * COVERAGE_HEADING_RAD - turn, 2.0 * NAV_PI));
        double begin = angle > COVERAGE_STRAIGHT_RAD ? c->options.begin_s : 0.0;
        int state = ((int)row * g->columns + (int)column) * COVERAGE_HEADINGS + heading;
        coverage_reach(c, state,
                       (struct coverage_state){.seconds = (float)(angle / c->options.turn_rad_s + begin),
                                               .passed = 1.0F,
                                               .from = COVERAGE_NOWHERE});
    }
    return true;
}

/* The best end of all ways that the budget allows; COVERAGE_NOWHERE: none. */
static int coverage_search(struct nav_coverage *c, long *spent)
{
    double most = 0.0;
    int best = COVERAGE_NOWHERE;
    while (c->waiting > 0 && (c->options.budget <= 0 || *spent < c->options.budget)) {
        int state = coverage_pop(c);
        const struct coverage_state *s = &c->state[state];
        /* A way costs its beginning once, so that of ways with one rate the longer is better. */
        double rate = (double)s->swept / ((double)s->seconds + c->options.begin_s);
        if ((double)s->swept >= c->options.least_m2 && rate > most) {
            most = rate;
            best = state;
        }
        coverage_forward(c, state);
        coverage_turn(c, state, 1);
        coverage_turn(c, state, -1);
        (*spent)++;
    }
    return best;
}

/* Whether the way goes on in another direction here. */
static bool coverage_is_corner(const struct nav_coverage *c, int state, int after)
{
    return after == COVERAGE_NOWHERE || (coverage_turned(c, after) && !coverage_turned(c, state));
}

static void coverage_tell(const struct nav_coverage *c, int end, struct nav_coverage_plan *out)
{
    const struct nav_coverage_ground *g = &c->ground;
    int corners = 0;
    for (int state = end, after = COVERAGE_NOWHERE; c->state[state].from != COVERAGE_NOWHERE;
         after = state, state = c->state[state].from)
        corners += coverage_is_corner(c, state, after);
    int place = corners;
    for (int state = end, after = COVERAGE_NOWHERE; c->state[state].from != COVERAGE_NOWHERE;
         after = state, state = c->state[state].from) {
        if (!coverage_is_corner(c, state, after) || --place >= NAV_COVERAGE_CORNERS_MOST)
            continue;
        int cell = state / COVERAGE_HEADINGS;
        out->x[place] = g->x + (cell % g->columns + 0.5) * g->cell;
        out->y[place] = g->y + (cell / g->columns + 0.5) * g->cell;
    }
    out->corners = corners < NAV_COVERAGE_CORNERS_MOST ? corners : NAV_COVERAGE_CORNERS_MOST;
    out->swept_m2 = (double)c->state[end].swept;
    out->seconds = (double)c->state[end].seconds;
    out->passed = (double)c->state[end].passed;
}

void nav_coverage_plan(struct nav_coverage *c, const struct nav_coverage_ground *ground, double x, double y,
                       double turn, struct nav_coverage_plan *out)
{
    *out = (struct nav_coverage_plan){.passed = 1.0};
    if (ground->columns < 1 || ground->rows < 1 || !(ground->cell > 0.0) ||
        (double)ground->columns * ground->rows > c->cells)
        return;
    c->ground = *ground;
    c->waiting = 0;
    for (long k = 0; k < (long)ground->columns * ground->rows * COVERAGE_HEADINGS; k++)
        c->state[k].place = COVERAGE_NEW;
    for (int k = 0; k < c->options.asides; k++) {
        c->offset[0][k] = (int)lround(c->aside[k] / ground->cell);
        c->offset[1][k] = (int)lround(c->aside[k] / ground->cell / sqrt(2.0));
    }
    if (!coverage_begin(c, x, y, turn))
        return;
    int end = coverage_search(c, &out->spent);
    if (end != COVERAGE_NOWHERE)
        coverage_tell(c, end, out);
}
