#include "kidnap.h"

#include <math.h>

#include "map_belief.h"

/* Nats by which a new map explains rows better than the one in use: NOTICED, a kidnap is decided on; MORE, after a
 * decision that it was none. A kidnap once in ten thousand rows costs 9; the rest is how much the ratio varies where
 * the map in use is a little off. */
static const double NOTICED = 25.0, MORE = 10.0;
static const double BARE_M = 0.05, BARE_RAD = 0.05; /* how well the place is known where tiles are otherwise */
static const double FLOOR_SHARE = 0.1; /* of the evidence for tiles: windows are more certain than they should be */
/* Wheels that slipped by SLIP_M and SLIP_RAD, or a floor other than mapped, are preferred to a kidnap within RATHER
 * nats, and taken over when they explain the rows MENDED nats better. */
static const double RATHER = 12.0, MENDED = 5.0, SLIP_M = 0.15, SLIP_RAD = 0.3;
enum { CALM_ROWS = 64, SPLITS = 12, TRIED = 3 }; /* TRIED: of so many hypotheses' trusts, one */

int nav_kidnap_init(struct nav_kidnap *k, const struct nav_problem *problem)
{
    int failed = nav_particle_map_init(&k->fresh, problem->arena.classes);
    failed |= nav_kept_init(&k->calm, problem) | nav_kept_init(&k->tried, problem);
    k->enough = NOTICED;
    return failed ? -1 : 0;
}

void nav_kidnap_free(struct nav_kidnap *k)
{
    nav_particle_map_free(&k->fresh);
    nav_kept_free(&k->calm);
    nav_kept_free(&k->tried);
}

/* Whether the rows since `since` can be taken again, at once. */
static bool kidnap_held(const struct nav_kidnap *k, const struct nav_kidnap_view *v)
{
    return v->course->row - k->since <= NAV_KIDNAP_AGAIN && nav_record_has(v->record, k->since);
}

static void kidnap_catch_up(struct nav_kept *kept, const struct nav_kidnap_view *v, long row)
{
    while (kept->course.row < row)
        nav_kept_take(kept, v->record);
}

/* Log-likelihood of the rows since then by a map begun anew, but for textures; the map is `tried`. */
static double kidnap_anew(struct nav_kidnap *k, const struct nav_kidnap_view *v, long row)
{
    k->tried.map.scale = 1.0;
    nav_kept_begin(&k->tried, row);
    kidnap_catch_up(&k->tried, v, v->course->row);
    return k->tried.map.evidence;
}

/* Log-likelihood of the rows since then by the map in use, as nav_course_evidence counts it. */
static double kidnap_gained(const struct nav_kidnap *k, const struct nav_kidnap_view *v, long row)
{
    double sum = 0.0;
    for (; row < v->course->row; row++)
        sum += k->gained[row % NAV_KIDNAP_AGAIN].contacts + k->gained[row % NAV_KIDNAP_AGAIN].windows;
    return sum;
}

static void kidnap_calm(struct nav_kidnap *k, const struct nav_kidnap_view *v)
{
    k->ratio = k->felt = 0.0;
    k->enough = NOTICED;
    k->doubts = 0;
    k->since = v->course->row;
    nav_particle_map_begin(&k->fresh);
}

void nav_kidnap_begin(struct nav_kidnap *k, const struct nav_kidnap_view *v)
{
    kidnap_calm(k, v);
    nav_kept_copy(&k->calm, v->map, v->course);
}

/* Finds the row at which a map begun anew takes over best from the map in use; `tried` is then that new map. */
static long kidnap_split(struct nav_kidnap *k, const struct nav_kidnap_view *v)
{
    long step = 1 + (v->course->row - k->since) / SPLITS, best = k->since;
    double held = 0.0, most = -INFINITY;
    for (long row = k->since; row < v->course->row; row++) {
        if ((row - k->since) % step == 0) {
            double total = held + kidnap_anew(k, v, row);
            best = total > most ? row : best;
            most = fmax(total, most);
        }
        const struct nav_gained *gained = &k->gained[row % NAV_KIDNAP_AGAIN];
        held += gained->contacts + gained->windows - gained->patches;
    }
    (void)kidnap_anew(k, v, best);
    return best;
}

/* How rows go on in the calm map: at the pose that it believes, known so well, with its tiles or without. */
struct kidnap_entry {
    double sigma_m, sigma_rad;
    bool tiles;
};

static double kidnap_try_at(struct nav_kidnap *k, const struct nav_kidnap_view *v, const struct kidnap_entry *entry,
                            double scale)
{
    nav_kept_copy(&k->tried, &k->calm.map, &k->calm.course);
    k->tried.map.scale = scale;
    k->tried.map.floor.known &= entry->tiles;
    nav_kept_enter(&k->tried, nav_particle_map_pose(&k->calm.map), entry->sigma_m, entry->sigma_rad);
    kidnap_catch_up(&k->tried, v, v->course->row);
    return nav_course_evidence(&k->tried.course, &k->tried.map);
}

/* Tries an entry with as much trust in the odometry as suits the rows best. Returns their log-likelihood; the map with
 * them is `tried`. */
static double kidnap_try(struct nav_kidnap *k, const struct nav_kidnap_view *v, const struct kidnap_entry *entry)
{
    int best = 0;
    double most = -INFINITY, last = 0.0;
    for (int n = 0; n < NAV_HYPOTHESES; n += TRIED) {
        last = kidnap_try_at(k, v, entry, nav_hypothesis_scale(n));
        best = last > most ? n : best;
        most = fmax(last, most);
    }
    return last < most ? kidnap_try_at(k, v, entry, nav_hypothesis_scale(best)) : last;
}

/* Log-likelihood of all windows so far by tiles, over patches of any shape. */
static double kidnap_floor(const struct nav_kept *kept)
{
    const struct nav_floor *floor = &kept->map.floor;
    return floor->known ? fmax(floor->evidence - nav_trail_patches(&kept->course.trail, true), 0.0) : 0.0;
}

/* Rows that the map does not explain: the wheels may have slipped, or the floor is otherwise than mapped, or the robot
 * was carried off. */
static enum nav_kidnap_verdict kidnap_decide(struct nav_kidnap *k, const struct nav_kidnap_view *v)
{
    const struct kidnap_entry slip = {SLIP_M, SLIP_RAD, true}, bare = {BARE_M, BARE_RAD, false};
    long split = kidnap_split(k, v);
    double anew = nav_course_evidence(&k->tried.course, &k->tried.map), held = kidnap_gained(k, v, split);
    kidnap_catch_up(&k->calm, v, split);
    double without = kidnap_try(k, v, &bare) - FLOOR_SHARE * kidnap_floor(&k->calm);
    double slipped = kidnap_try(k, v, &slip), mended = fmax(without, slipped);
    if (mended <= anew - RATHER)
        return NAV_KIDNAP_CARRIED;
    k->enough = k->ratio + MORE;
    if (mended < fmax(anew, held) + MENDED)
        return NAV_KIDNAP_NONE;
    if (without > slipped)
        (void)kidnap_try(k, v, &bare);
    return NAV_KIDNAP_MENDED;
}

static bool kidnap_read(const struct nav_record *r, const struct nav_record_row *row, int tip)
{
    return row->window[(ptrdiff_t)tip * (1 + r->classes)] >= 0.0F;
}

/* Gives what patches explain a row's windows better by to the tiles that these are of. */
static void kidnap_doubt(struct nav_kidnap *k, const struct nav_kidnap_view *v, const struct nav_record_row *row,
                         double nats)
{
    int column, line, read = 0;
    for (int tip = 0; tip < v->record->tips; tip++)
        read += kidnap_read(v->record, row, tip);
    for (int tip = 0; tip < v->record->tips; tip++) {
        const struct nav_tip *at = &v->record->problem->robot.tip[tip];
        if (!kidnap_read(v->record, row, tip))
            continue;
        nav_floor_at(&v->map->floor, &v->map->joint, at->x, at->y, &column, &line);
        int n = 0;
        while (n < k->doubts && (k->doubt[n].column != column || k->doubt[n].row != line))
            n++;
        if (n == NAV_KIDNAP_DOUBTS)
            continue;
        if (n == k->doubts)
            k->doubt[k->doubts++] = (struct nav_doubt){column, line, 0.0};
        k->doubt[n].nats += nats / read;
    }
}

enum nav_kidnap_verdict nav_kidnap_take(struct nav_kidnap *k, const struct nav_kidnap_view *v,
                                        const struct nav_record_row *row, const struct nav_gained *gained)
{
    double before = k->fresh.evidence;
    nav_particle_map_take(&k->fresh, v->record, row);
    k->gained[row->number % NAV_KIDNAP_AGAIN] = *gained;
    k->felt += k->fresh.evidence - before - gained->contacts;
    if (v->map->floor.known)
        kidnap_doubt(k, v, row, gained->patches - gained->windows);
    k->ratio = k->felt;
    for (int n = 0; n < k->doubts; n++)
        k->ratio += fmin(k->doubt[n].nats, NAV_MAP_TILE);
    if (k->ratio <= 0.0 || !kidnap_held(k, v)) {
        kidnap_calm(k, v);
        if (v->course->row - k->calm.course.row >= CALM_ROWS)
            nav_kept_copy(&k->calm, v->map, v->course);
    }
    return k->ratio > k->enough ? kidnap_decide(k, v) : NAV_KIDNAP_NONE;
}

size_t nav_kidnap_bytes(const struct nav_record *r)
{
    size_t trail = NAV_TRAIL_MOST * ((size_t)r->classes + 6) * sizeof(float);
    size_t cells = (size_t)NAV_CELLS_SIDE * NAV_CELLS_SIDE * sizeof(float);
    size_t kept = nav_particle_map_bytes(r->classes) + trail + cells;
    return nav_particle_map_bytes(r->classes) + 2 * kept;
}
