#include "map_belief.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "trust.h"

/* As NAV_MAP_TILE, of a box and of a thing that is not mapped. */
static const double BOX = 3.0, THING = 6.0;
/* One found as mapped is surer of it by as much again at most, one found otherwise by this. */
static const double KEPT_MOST = 4.0;
/* Contacts within this distance are with one thing; one within three of a known thing is likely part of it. */
static const double THING_M = 0.1, THING_REACH_M = 0.15, PART = 3.0, PART_NATS = 4.0;
/* A contact nearer than mapped by more than this is with something else. */
static const double NEAR_M = 0.03;

int nav_map_init(struct nav_map_belief *m, const struct nav_arena *reported, size_t sensors)
{
    size_t tiles = (size_t)reported->columns * (size_t)reported->rows;
    *m = (struct nav_map_belief){.reported = reported, .arena = *reported};
    m->floor = malloc(tiles + 1);
    m->tile = calloc(tiles + 1, sizeof *m->tile);
    m->gone = calloc((size_t)reported->boxes + 1, sizeof *m->gone);
    m->suspect = calloc(sensors + 1, sizeof *m->suspect);
    if (!m->floor || !m->tile || !m->gone || !m->suspect)
        return -1;
    memcpy(m->floor, reported->floor, tiles);
    m->arena.floor = m->floor;
    return 0;
}

void nav_map_free(struct nav_map_belief *m)
{
    free(m->floor);
    free(m->tile);
    free(m->gone);
    free(m->suspect);
}

size_t nav_map_bytes(const struct nav_map_belief *m)
{
    return (size_t)m->reported->columns * (size_t)m->reported->rows * (sizeof *m->tile + 1) +
           (size_t)m->reported->boxes * sizeof *m->gone;
}

static float map_kept(double nats, double cost)
{
    return (float)fmin(fmax(nats, -cost), cost + KEPT_MOST);
}

/* Whether a place is taken to differ from the map, given whether it was: neither is given up for the first reading
 * against it. */
static bool map_wrong(double nats, double cost, bool before)
{
    return nats > (before ? cost - KEPT_MOST : cost);
}

/* Nearest of the things within `reach` of a point that hold more than `least`; NULL: there is none. */
static const struct nav_map_thing *map_nearest(const struct nav_map_belief *m, double x, double y, double reach,
                                               double least)
{
    const struct nav_map_thing *nearest = NULL;
    for (int n = 0; n < m->things; n++) {
        double far = hypot(m->thing[n].x - x, m->thing[n].y - y);
        if (far > reach || m->thing[n].nats <= least)
            continue;
        nearest = &m->thing[n];
        reach = far;
    }
    return nearest;
}

/* Room for a new thing: that of the least likely one when all is taken. */
static struct nav_map_thing *map_room(struct nav_map_belief *m)
{
    struct nav_map_thing *least = &m->thing[0];
    if (m->things < NAV_MAP_THINGS)
        return &m->thing[m->things++];
    for (int n = 1; n < m->things; n++)
        least = m->thing[n].nats < least->nats ? &m->thing[n] : least;
    return least;
}

void nav_map_begin(struct nav_likelihood *l)
{
    for (int n = 0; n < l->reads; n++)
        l->map.suspect[l->read[n]].mass = 0.0;
    l->map.mass = 0.0;
}

/* Place whose being wrong would explain a reading of an object whisker: where it felt something before what is mapped,
 * or the box that it should have felt. */
static struct nav_map_suspect map_suspect_ray(const struct nav_likelihood *l, int w, const struct nav_place *at,
                                              int code)
{
    const struct nav_model *ray = &l->model[w];
    double felt = l->reading[w][0], reported = (code + 1.5) * ray->step;
    bool nothing = code >= ray->codes - 2, before = isfinite(felt) && (nothing || felt < reported - NEAR_M);
    double far = before ? felt : reported;
    struct nav_map_suspect suspect = {
        .kind = before ? NAV_MAP_THING : NAV_MAP_BOX,
        .x = nav_place_x(at, ray->place.x + far * ray->place.c, ray->place.y + far * ray->place.s),
        .y = nav_place_y(at, ray->place.x + far * ray->place.c, ray->place.y + far * ray->place.s)};
    if (!before) /* of things `which` is 0 */
        suspect.which = nothing ? -1 : nav_obstacles_at(&l->obstacles, suspect.x, suspect.y);
    return suspect;
}

/* Likelihood of a sensor's reading by that of a broken one, weight aside. */
static double map_ratio(const struct nav_likelihood *l, int w, int code)
{
    return l->trust[w].working * l->ratio[w][code] + 1.0 - l->trust[w].working;
}

/* A whisker that feels nothing where a contact was takes that back. */
static void map_pass(struct nav_likelihood *l, int w, const struct nav_place *at)
{
    const struct nav_model *ray = &l->model[w];
    double c = at->c * ray->place.c - at->s * ray->place.s, s = at->s * ray->place.c + at->c * ray->place.s;
    double x0 = nav_place_x(at, ray->place.x, ray->place.y), y0 = nav_place_y(at, ray->place.x, ray->place.y);
    for (int n = 0; n < l->map.things; n++) {
        struct nav_map_thing *thing = &l->map.thing[n];
        double along = c * (thing->x - x0) + s * (thing->y - y0), across = c * (thing->y - y0) - s * (thing->x - x0);
        if (along > 0.0 && along < ray->length - NEAR_M && fabs(across) < NEAR_M)
            thing->nats = fmax(thing->nats + l->weight[w] * log(map_ratio(l, w, 0)), 0.0);
    }
}

static struct nav_map_suspect map_suspect(const struct nav_likelihood *l, int w, const struct nav_place *at, int code)
{
    const struct nav_model *model = &l->model[w];
    struct nav_map_suspect suspect = {.which = -1};
    if (model->kind->distance && !(l->unmapped[w].states > 0 && code == model->codes - 1)) /* nothing is mapped there */
        suspect = map_suspect_ray(l, w, at, code);
    else if (model->kind->floor && l->map.reported->classes > 1)
        suspect.which = nav_arena_tile(l->map.reported, nav_place_x(at, model->place.x, model->place.y),
                                       nav_place_y(at, model->place.x, model->place.y));
    return suspect;
}

static bool map_same(const struct nav_map_suspect *a, const struct nav_map_suspect *b)
{
    bool near = hypot(a->x - b->x, a->y - b->y) < THING_M;
    return a->kind == b->kind && (a->kind == NAV_MAP_THING ? near : a->which == b->which);
}

void nav_map_add(struct nav_likelihood *l, const struct nav_place *at, const uint8_t *codes, double mass)
{
    for (int n = 0; n < l->reads; n++) {
        int w = l->read[n];
        struct nav_map_suspect *suspect = &l->map.suspect[w], now = map_suspect(l, w, at, codes[w]);
        if (l->map.mass == 0.0 && l->model[w].kind->distance && isinf(l->reading[w][0]))
            map_pass(l, w, at);
        if (suspect->mass == 0.0)
            *suspect = now;
        suspect->mass += now.which >= 0 && map_same(suspect, &now) ? mass : 0.0;
    }
    l->map.mass += mass;
}

/* Evidence for a place that differs from the map: `share` of the belief would then give the reading `ratio`, and the
 * rest what all of it gives now. */
static double map_evidence(const struct nav_likelihood *l, int w, double ratio)
{
    const struct nav_trust *t = &l->trust[w];
    double reported = 0.0, known = 0.0, share = l->map.suspect[w].mass / l->map.mass;
    for (int k = 0; k < t->codes; k++) {
        known += t->predicted[k];
        reported += t->predicted[k] > 0.0 ? t->predicted[k] * map_ratio(l, w, k) : 0.0;
    }
    return known > 0.0 ? l->weight[w] * log(share * ratio * known / reported + 1.0 - share) : 0.0;
}

/* Learning functions return whether the place is taken to be wrong from now on. */
static bool map_learn_tile(struct nav_likelihood *l, int w, int which)
{
    struct nav_map_belief *m = &l->map;
    int reported = m->reported->floor[which], best = reported == 0;
    struct nav_map_tile *tile = &m->tile[which];
    if (reported >= m->reported->classes)
        return false;
    for (int k = 0; k < m->reported->classes; k++)
        best = k != reported && l->ratio[w][k] > l->ratio[w][best] ? k : best;
    if (tile->nats <= 0.0f)
        tile->other = (uint8_t)best;
    bool wrong = m->floor[which] != reported;
    double nats = map_evidence(l, w, map_ratio(l, w, wrong ? reported : tile->other));
    tile->nats = map_kept((double)tile->nats + (wrong ? -nats : nats), NAV_MAP_TILE);
    m->floor[which] = map_wrong((double)tile->nats, NAV_MAP_TILE, wrong) ? tile->other : (uint8_t)reported;
    return !wrong && m->floor[which] != reported;
}

/* A box taken to be gone stays so: what is felt there later is a new thing. */
static bool map_learn_box(struct nav_likelihood *l, int w, int which)
{
    float *gone = &l->map.gone[which];
    *gone = map_kept((double)*gone + map_evidence(l, w, map_ratio(l, w, l->model[w].codes - 2)), BOX);
    if ((double)*gone > BOX)
        nav_obstacles_hide(&l->obstacles, which, true);
    return (double)*gone > BOX;
}

/* A contact where the map shows nothing. */
static bool map_learn_thing(struct nav_likelihood *l, int w, double x, double y)
{
    struct nav_map_belief *m = &l->map;
    const struct nav_map_thing *near = map_nearest(m, x, y, THING_M, -INFINITY);
    struct nav_map_thing *thing = near ? &m->thing[near - m->thing] : NULL;
    double nats = map_evidence(l, w, 1.0);
    if (nats <= 0.0)
        return false;
    if (!thing) {
        double part = map_nearest(m, x, y, PART * THING_M, THING) ? PART_NATS : 0.0;
        thing = map_room(m);
        *thing = (struct nav_map_thing){x, y, part};
    }
    bool before = thing->nats > THING;
    thing->nats = fmin(thing->nats + nats, THING + KEPT_MOST);
    return !before && thing->nats > THING;
}

void nav_map_learn(struct nav_likelihood *l)
{
    for (int n = 0; n < l->reads; n++) {
        int w = l->read[n];
        const struct nav_map_suspect *suspect = &l->map.suspect[w];
        bool wrong = false;
        if (suspect->mass > 0.0 && suspect->kind == NAV_MAP_THING)
            wrong = map_learn_thing(l, w, suspect->x, suspect->y);
        else if (suspect->mass > 0.0 && suspect->kind == NAV_MAP_BOX)
            wrong = map_learn_box(l, w, suspect->which);
        else if (suspect->mass > 0.0)
            wrong = map_learn_tile(l, w, suspect->which);
        if (wrong) /* what contradicted the belief was not the sensor's fault */
            nav_trust_restore(&l->trust[w]);
    }
}

void nav_map_forget(struct nav_likelihood *l)
{
    struct nav_map_belief *m = &l->map;
    for (int n = 0; n < m->reported->columns * m->reported->rows; n++) {
        if (m->tile[n].nats == 0.0f)
            continue;
        m->tile[n].nats = 0.0f;
        m->floor[n] = m->reported->floor[n];
    }
    for (int b = 0; b < m->reported->boxes; b++) {
        if ((double)m->gone[b] > BOX)
            nav_obstacles_hide(&l->obstacles, b, false);
        m->gone[b] = 0.0f;
    }
    m->things = 0;
}

void nav_map_apply(const struct nav_likelihood *l, const struct nav_place *at, uint8_t *codes)
{
    for (int n = 0; n < l->reads; n++) {
        int w = l->read[n];
        const struct nav_model *ray = &l->model[w];
        if (!ray->kind->distance || !isfinite(l->reading[w][0]) || !(l->table[w][codes[w]] < 0.0f))
            continue;
        double felt = l->reading[w][0];
        double x = nav_place_x(at, ray->place.x + felt * ray->place.c, ray->place.y + felt * ray->place.s);
        double y = nav_place_y(at, ray->place.x + felt * ray->place.c, ray->place.y + felt * ray->place.s);
        if (map_nearest(&l->map, x, y, THING_REACH_M, THING))
            codes[w] = (uint8_t)(ray->codes - 1);
    }
}
