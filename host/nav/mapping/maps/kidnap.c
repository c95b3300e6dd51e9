#include "kidnap.h"

#include <math.h>
#include <string.h>

/* Nats by which a new map explains rows better than the one in use: SUSPECTED, a second map is made of these rows;
 * NOTICED, a kidnap is decided on; MORE, after a decision that it was none. A kidnap once in ten thousand rows costs 9;
 * the rest is how much the ratio varies where the map in use is a little off. */
static const double SUSPECTED = 10.0, NOTICED = 25.0, MORE = 10.0;
static const double TILE = 6.0;    /* nats that a tile costs which is otherwise than mapped, as in map_belief */
static const double PROVEN = 20.0; /* and by which a place in the map from before does, of rows held to be in another */
static const double MET = 0.999;   /* probability of one motion between two maps, before it is tried */
static const double JOINED = 6.0;  /* nats by which one map must explain the rows better than two do */
static const double SAME_M = 0.5, SAME_RAD = 0.5;         /* a motion so small is no kidnap */
static const double ENTERED_M = 0.05, ENTERED_RAD = 0.05; /* how well a place is known at which maps meet */
static const double FLOOR_SHARE = 0.1; /* of the evidence for tiles: windows are more certain than they should be */
/* Wheels that slipped by SLIP_M and SLIP_RAD, or a floor other than mapped, are preferred to a kidnap within RATHER
 * nats, and taken over when they explain the rows MENDED nats better. */
static const double RATHER = 12.0, MENDED = 5.0, SLIP_M = 0.15, SLIP_RAD = 0.3;
static const double SAME_PLACE_M = 0.2, SAME_PLACE_RAD = 0.3; /* one motion, found again */
static const double SURE_SCORE = 30.0;                        /* nats of a motion that is found twice */
static const double ALIKE = 40.0, CLEARLY = 7.0; /* nats within which other motions are tried; by which one is better */
enum {
    CALM_ROWS = 64,
    SECOND_ROWS = 800,
    SUSPECT_ROWS = 800,
    SOUGHT_ROWS = 150,
    CATCH_UP_MOST = NAV_MAPPER_AGAIN,
    SPLITS = 12,
    OTHERS = 3
};

/* Where rows enter a map. */
struct kidnap_entry {
    long begun;
    struct nav_pose pose;
    double sigma_m, sigma_rad;
    enum { TILES_AS_MAPPED, TILES_RENAMED, NO_TILES } floor;
};

int nav_kidnap_init(struct nav_kidnaps *k, const struct nav_problem *problem)
{
    int classes = problem->arena.classes, failed = nav_particle_map_init(&k->fresh, classes);
    failed |=
        nav_kept_init(&k->calm, problem) | nav_kept_init(&k->second, problem) | nav_kept_init(&k->joined, problem);
    for (int n = 0; n < 2; n++)
        failed |= nav_kept_init(&k->before[n], problem);
    for (int n = 0; n < NAV_MAPPER_KEPT; n++)
        failed |= nav_kept_init(&k->kept[n], problem);
    k->parts = 1;
    k->enough = NOTICED;
    k->part[0] = (struct nav_mapper_part){.into = -1, .joined = -1};
    return nav_meeting_init(&k->meeting, classes) || failed ? -1 : 0;
}

void nav_kidnap_free(struct nav_kidnaps *k)
{
    nav_particle_map_free(&k->fresh);
    nav_kept_free(&k->calm);
    nav_kept_free(&k->second);
    nav_kept_free(&k->joined);
    for (int n = 0; n < 2; n++)
        nav_kept_free(&k->before[n]);
    for (int n = 0; n < NAV_MAPPER_KEPT; n++)
        nav_kept_free(&k->kept[n]);
    nav_meeting_free(&k->meeting);
}

/* Whether rows from there on can be taken again, at once. */
static bool kidnap_held(const struct nav_mapper *m, long row)
{
    return m->course.row - row <= CATCH_UP_MOST && nav_record_has(&m->record, row);
}

/* Log-likelihood of the rows since then by a map begun anew, but for textures; the map is `joined`. */
static double kidnap_anew(struct nav_mapper *m, long row)
{
    struct nav_kept *joined = &m->kidnaps.joined;
    joined->map.scale = 1.0;
    nav_kept_begin(joined, row);
    while (joined->course.row < m->course.row)
        nav_kept_take(joined, &m->record);
    return joined->map.evidence;
}

/* Log-likelihood of the rows since then by the map in use, as nav_course_evidence counts it. */
static double kidnap_gained(const struct nav_mapper *m, long row)
{
    double sum = 0.0;
    for (; row < m->course.row; row++)
        sum += m->kidnaps.gained[row % CATCH_UP_MOST].contacts + m->kidnaps.gained[row % CATCH_UP_MOST].windows;
    return sum;
}

static void kidnap_calm(struct nav_mapper *m)
{
    struct nav_kidnaps *k = &m->kidnaps;
    k->ratio = k->felt = 0.0;
    k->enough = NOTICED;
    k->doubts = 0;
    k->since = m->course.row;
    nav_particle_map_begin(&k->fresh);
    if (m->course.row - k->calm.course.row >= CALM_ROWS || k->calm.course.part != m->course.part)
        nav_kept_copy(&k->calm, nav_mapper_best(m), &m->course);
}

/* The second map begins anew, to be sought in the map as it was when the one before it began. */
static void kidnap_second(struct nav_mapper *m)
{
    struct nav_kidnaps *k = &m->kidnaps;
    const struct nav_particle_map *best = nav_mapper_best(m);
    struct nav_kept spare = k->before[1];
    k->before[1] = k->before[0];
    k->before[0] = spare;
    nav_kept_copy(&k->before[0], best, &m->course);
    nav_kept_begin(&k->second, m->course.row);
    k->suspected = false;
    k->placed = nav_particle_map_pose(best);
    k->then = nav_course_evidence(&m->course, best);
}

/* Finds the row at which a map begun anew takes over best from the map in use; `joined` is then that new map. */
static long kidnap_split(struct nav_mapper *m)
{
    struct nav_kidnaps *k = &m->kidnaps;
    long step = 1 + (m->course.row - k->since) / SPLITS, best = k->since;
    double held = 0.0, most = -INFINITY;
    for (long row = k->since; row < m->course.row; row++) {
        if ((row - k->since) % step == 0) {
            double total = held + kidnap_anew(m, row);
            best = total > most ? row : best;
            most = fmax(total, most);
        }
        const struct nav_gained *gained = &k->gained[row % CATCH_UP_MOST];
        held += gained->contacts + gained->windows - gained->patches;
    }
    (void)kidnap_anew(m, best);
    return best;
}

/* Rows since which the robot may have been carried off become the second map. */
static void kidnap_suspect(struct nav_mapper *m)
{
    struct nav_kidnaps *k = &m->kidnaps;
    const struct nav_particle_map *best = nav_mapper_best(m);
    while (k->calm.course.row < k->since)
        nav_kept_take(&k->calm, &m->record);
    nav_kept_copy(&k->before[1], &k->calm.map, &k->calm.course);
    long split = kidnap_split(m);
    while (k->before[1].course.row < split)
        nav_kept_take(&k->before[1], &m->record);
    k->placed = nav_particle_map_pose(&k->before[1].map);
    nav_kept_copy(&k->second, &k->joined.map, &k->joined.course);
    k->then = nav_course_evidence(&m->course, best) - kidnap_gained(m, split);
    k->suspected = true;
}

void nav_kidnap_restart(struct nav_mapper *m)
{
    m->sought = m->course.trail.borders;
    m->kidnaps.calm.course.part = -1;
    kidnap_calm(m);
    kidnap_second(m);
    nav_kept_copy(&m->kidnaps.before[1], nav_mapper_best(m), &m->course);
}

static struct nav_mapper_part *kidnap_part(struct nav_mapper *m, long first)
{
    struct nav_kidnaps *k = &m->kidnaps;
    if (k->parts == NAV_MAPPER_PARTS) { /* the oldest kidnaps are forgotten, the first part is not */
        memmove(&k->part[1], &k->part[2], (NAV_MAPPER_PARTS - 2) * sizeof *k->part);
        k->parts--;
    }
    k->part[k->parts] = (struct nav_mapper_part){
        .number = k->part[k->parts - 1].number + 1, .first = first, .noticed = m->course.row, .into = -1, .joined = -1};
    return &k->part[k->parts++];
}

/* Keeps a map for later; where there is no room, in place of the one of the fewest rows. */
static void kidnap_keep(struct nav_kidnaps *k, struct nav_kept *map)
{
    int at = k->count;
    if (k->count == NAV_MAPPER_KEPT) {
        at = 0;
        for (int n = 1; n < k->count; n++)
            at = k->kept[n].map.faces.count < k->kept[at].map.faces.count ? n : at;
    } else {
        k->count++;
    }
    struct nav_kept spare = k->kept[at];
    k->kept[at] = *map;
    *map = spare;
}

static double kidnap_try_at(struct nav_mapper *m, const struct nav_kept *older, const struct kidnap_entry *entry,
                            double scale)
{
    struct nav_kidnaps *k = &m->kidnaps;
    nav_kept_copy(&k->joined, &older->map, &older->course);
    k->joined.map.scale = scale;
    k->joined.map.floor.known &= entry->floor != NO_TILES;
    if (entry->floor == TILES_RENAMED)
        nav_floor_forget(&k->joined.map.floor);
    nav_kept_enter(&k->joined, entry->begun, entry->pose, entry->sigma_m, entry->sigma_rad);
    while (k->joined.course.row < m->course.row)
        nav_kept_take(&k->joined, &m->record);
    return nav_course_evidence(&k->joined.course, &k->joined.map);
}

/* Tries rows in an older map, with as much trust in the odometry as suits them best. Returns their log-likelihood; the
 * map with them is `joined`. */
static double kidnap_try(struct nav_mapper *m, const struct nav_kept *older, const struct kidnap_entry *entry)
{
    int best = 0;
    double most = -INFINITY, last = 0.0;
    for (int n = 0; n < NAV_MAPPER_HYPOTHESES; n++) {
        last = kidnap_try_at(m, older, entry, m->hypothesis[n].scale);
        best = last > most ? n : best;
        most = fmax(last, most);
    }
    return last < most ? kidnap_try_at(m, older, entry, m->hypothesis[best].scale) : last;
}

static void kidnap_join(struct nav_mapper *m, struct nav_mapper_part *part, struct nav_pose at)
{
    part->into = m->kidnaps.joined.course.part;
    part->joined = m->course.row;
    part->place = at;
    nav_mapper_adopt(m, &m->kidnaps.joined);
    nav_kidnap_restart(m);
}

/* Log-likelihood of the rows from `begun` on in the older map, at the best place that was found, where they are then in
 * `joined`; -INFINITY: they are as likely at another place. from: where they begin in the younger. */
static double kidnap_there(struct nav_mapper *m, const struct nav_kept *older, long begun, struct nav_pose from)
{
    const struct nav_meeting *meeting = &m->kidnaps.meeting;
    struct kidnap_entry entry = {.begun = begun, .sigma_m = ENTERED_M, .sigma_rad = ENTERED_RAD};
    double other = -INFINITY;
    for (int n = 1; n < meeting->places && n < OTHERS && meeting->place[n].score > meeting->place[0].score - ALIKE;
         n++) {
        entry.pose = nav_compose(meeting->place[n].at, from);
        other = fmax(other, kidnap_try(m, older, &entry));
    }
    entry.pose = nav_compose(meeting->place[0].at, from);
    double here = kidnap_try(m, older, &entry);
    return here > other + CLEARLY ? here : -INFINITY;
}

/* Log-likelihood of all windows so far by tiles, over patches of any shape. */
static double kidnap_floor(const struct nav_kept *kept)
{
    const struct nav_floor *floor = &kept->map.floor;
    return floor->known ? fmax(floor->evidence - nav_trail_patches(&kept->course.trail, true), 0.0) : 0.0;
}

/* Rows that the map does not explain: the wheels may have slipped, or the floor is otherwise than mapped, or the robot
 * was carried off. Then what is known is kept, and a second map is made from the rows since. */
static void kidnap_begin(struct nav_mapper *m)
{
    struct nav_kidnaps *k = &m->kidnaps;
    long split = kidnap_split(m);
    double anew = nav_course_evidence(&k->joined.course, &k->joined.map), held = kidnap_gained(m, split);
    nav_kept_copy(&k->second, &k->joined.map, &k->joined.course);
    while (k->calm.course.row < split)
        nav_kept_take(&k->calm, &m->record);
    struct nav_pose believed = nav_particle_map_pose(&k->calm.map);
    struct kidnap_entry slip = {split, believed, SLIP_M, SLIP_RAD, TILES_AS_MAPPED};
    struct kidnap_entry bare = {split, believed, ENTERED_M, ENTERED_RAD, NO_TILES};
    double without = kidnap_try(m, &k->calm, &bare) - FLOOR_SHARE * kidnap_floor(&k->calm),
           slipped = kidnap_try(m, &k->calm, &slip);
    if (fmax(without, slipped) > anew - RATHER) {
        k->enough = k->ratio + MORE;
        if (fmax(without, slipped) < fmax(anew, held) + MENDED)
            return;
        if (without > slipped)
            (void)kidnap_try(m, &k->calm, &bare);
        nav_mapper_adopt(m, &k->joined);
        nav_kidnap_restart(m);
        return;
    }
    kidnap_keep(k, &k->calm);
    k->second.course.part = kidnap_part(m, split)->number;
    nav_mapper_adopt(m, &k->second);
    nav_kidnap_restart(m);
}

static struct nav_mapper_part *kidnap_numbered(struct nav_kidnaps *k, int number)
{
    for (int n = 0; n < k->parts; n++) {
        if (k->part[n].number == number)
            return &k->part[n];
    }
    return &k->part[0];
}

static bool kidnap_same(struct nav_pose a, struct nav_pose b)
{
    return hypot(a.x - b.x, a.y - b.y) < SAME_PLACE_M && fabs(nav_wrap(a.theta - b.theta)) < SAME_PLACE_RAD;
}

/* Whether the robot was not carried off before the part in use: the rows since then fit where it stood in the older
 * map, after a slip or with other tiles, clearly better than a map of their own. `joined` is then the older map with
 * them. */
static bool kidnap_was_none(struct nav_mapper *m, const struct nav_kept *older)
{
    double enough = nav_course_evidence(&m->course, nav_mapper_best(m)) + PROVEN;
    struct nav_pose believed = nav_particle_map_pose(&older->map);
    struct kidnap_entry slip = {m->course.begun, believed, SLIP_M, SLIP_RAD, TILES_AS_MAPPED};
    struct kidnap_entry renamed = {m->course.begun, believed, ENTERED_M, ENTERED_RAD, TILES_RENAMED};
    return older->course.row == m->course.begun && kidnap_held(m, m->course.begun) &&
           (kidnap_try(m, older, &slip) > enough || kidnap_try(m, older, &renamed) > enough);
}

/* Joins the part in use, which is in `joined`, with a map that was kept. */
static void kidnap_end(struct nav_mapper *m, int which, struct nav_pose at)
{
    struct nav_kidnaps *k = &m->kidnaps;
    struct nav_kept spare = k->kept[which];
    k->kept[which] = k->kept[--k->count];
    k->kept[k->count] = spare;
    kidnap_join(m, kidnap_numbered(k, m->course.part), at);
}

/* Seeks the map in use in one that was kept. */
static void kidnap_meet(struct nav_mapper *m)
{
    struct nav_kidnaps *k = &m->kidnaps;
    int which = (int)(m->course.row / SOUGHT_ROWS) % k->count;
    const struct nav_particle_map *best = nav_mapper_best(m);
    struct nav_kept *older = &k->kept[which];
    if (kidnap_was_none(m, older)) {
        kidnap_end(m, which, nav_particle_map_pose(&older->map));
        return;
    }
    if (nav_meeting_find(&k->meeting, older, best, &m->course) < MET)
        return;
    struct nav_pose at = k->meeting.place[0].at, now = nav_compose(at, nav_particle_map_pose(best));
    bool again = kidnap_same(at, k->met) && k->met_part == older->course.part;
    bool sure = again && k->meeting.place[0].score > SURE_SCORE, held = kidnap_held(m, m->course.begun);
    double apart = nav_course_evidence(&m->course, best);
    double here = held ? kidnap_there(m, older, m->course.begun, m->course.entered) : apart;
    k->met = at;
    k->met_part = older->course.part;
    if (isinf(here) || (!sure && here < apart + JOINED))
        return;
    /* Where the older map explains the rows worse than the younger, what is known of the pose alone is taken over. */
    if (!held || here < apart - JOINED)
        (void)kidnap_try(m, older, &(struct kidnap_entry){m->course.row, now, ENTERED_M, ENTERED_RAD, TILES_AS_MAPPED});
    kidnap_end(m, which, at);
}

/* Seeks the last rows in the map of before them: whether the robot is in another place of it than is believed. */
static void kidnap_seek(struct nav_mapper *m)
{
    struct nav_kidnaps *k = &m->kidnaps;
    const struct nav_particle_map *best = nav_mapper_best(m);
    double sure = nav_meeting_find(&k->meeting, &k->before[1], &k->second.map, &k->second.course);
    struct nav_pose at = k->meeting.place[0].at;
    bool there =
        hypot(at.x - k->placed.x, at.y - k->placed.y) < SAME_M && fabs(nav_wrap(at.theta - k->placed.theta)) < SAME_RAD;
    bool again = k->found_by == k->second.course.begun && kidnap_same(at, k->found);
    k->found_by = sure < MET ? -1 : k->second.course.begun;
    k->found = at;
    if (sure < MET || there || !again)
        return;
    double held =
        fmax(nav_course_evidence(&m->course, best) - k->then, nav_course_evidence(&k->second.course, &k->second.map));
    if (kidnap_there(m, &k->before[1], k->second.course.begun, (struct nav_pose){0.0, 0.0, 0.0}) < held + PROVEN)
        return;
    kidnap_join(m, kidnap_part(m, k->second.course.begun), at);
}

/* Gives what patches explain a row's windows better by to the tiles that these are of. */
static void kidnap_doubt(struct nav_mapper *m, const struct nav_record_row *row, double nats)
{
    struct nav_kidnaps *k = &m->kidnaps;
    const struct nav_particle_map *best = nav_mapper_best(m);
    int column, line, read = 0;
    for (int tip = 0; tip < m->record.tips; tip++)
        read += row->window[(ptrdiff_t)tip * (1 + m->record.classes)] >= 0.0F;
    for (int tip = 0; tip < m->record.tips; tip++) {
        const struct nav_tip *at = &m->problem->robot.tip[tip];
        if (!(row->window[(ptrdiff_t)tip * (1 + m->record.classes)] >= 0.0F))
            continue;
        nav_floor_at(&best->floor, &best->joint, at->x, at->y, &column, &line);
        int n = 0;
        while (n < k->doubts && (k->doubt[n].column != column || k->doubt[n].row != line))
            n++;
        if (n == NAV_MAPPER_DOUBTS)
            continue;
        if (n == k->doubts)
            k->doubt[k->doubts++] = (struct nav_doubt){column, line, 0.0};
        k->doubt[n].nats += nats / read;
    }
}

void nav_kidnap_take(struct nav_mapper *m, const struct nav_record_row *row, double contacts, double windows,
                     double patches)
{
    struct nav_kidnaps *k = &m->kidnaps;
    const struct nav_particle_map *best = nav_mapper_best(m);
    double before = k->fresh.evidence;
    nav_particle_map_take(&k->fresh, &m->record, row);
    nav_particle_map_take(&k->second.map, &m->record, row);
    nav_course_follow(&k->second.course, &k->second.map, &m->record, row);
    windows = best->floor.known ? windows : patches;
    k->gained[(m->course.row - 1) % CATCH_UP_MOST] = (struct nav_gained){contacts, windows, patches};
    k->felt += k->fresh.evidence - before - contacts;
    if (best->floor.known)
        kidnap_doubt(m, row, patches - windows);
    double all = k->felt;
    k->ratio = k->felt;
    for (int n = 0; n < k->doubts; n++) {
        all += k->doubt[n].nats;
        k->ratio += fmin(k->doubt[n].nats, TILE);
    }
    long age = m->course.row - k->second.course.begun;
    if (k->ratio <= 0.0 || !kidnap_held(m, k->since))
        kidnap_calm(m);
    if (all > SUSPECTED && k->ratio > 0.0 && !k->suspected)
        kidnap_suspect(m);
    if (k->ratio > k->enough)
        kidnap_begin(m);
    else if (k->count && m->course.row % SOUGHT_ROWS == 0)
        kidnap_meet(m);
    else if (k->suspected ? age % (SUSPECT_ROWS / 4) == 0 : age % (SECOND_ROWS / 2) == 0 && !k->count)
        kidnap_seek(m);
    if (m->course.row - k->second.course.begun >= (k->suspected ? SUSPECT_ROWS : SECOND_ROWS))
        kidnap_second(m);
}

size_t nav_kidnap_bytes(const struct nav_record *r)
{
    size_t trail = NAV_TRAIL_MOST * ((size_t)r->classes + 6) * sizeof(float);
    size_t cells = (size_t)NAV_CELLS_SIDE * NAV_CELLS_SIDE * sizeof(float);
    size_t kept = nav_particle_map_bytes(r->classes) + trail + cells;
    return (NAV_MAPPER_KEPT + 7) * kept;
}
