#include "sequence.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double GAP_M = 0.5;  /* of way without a tile read again: the sequence is over */
static const double INSIDE = 0.9; /* probability of the tip's tile, below which a window tells nothing of it */
static const double WRONG = 0.05; /* share of tiles that are otherwise than mapped */
static const double ASTRAY = 0.1; /* prior of a place that is in no map, or not where the joint estimate has it */
enum { REACH = 2, SHIFTS = (2 * REACH + 1) * (2 * REACH + 1), TILES = NAV_FLOOR_SIDE * NAV_FLOOR_SIDE };

int nav_sequence_init(struct nav_sequence *s, int classes)
{
    *s = (struct nav_sequence){.classes = classes, .begun = -1, .weighed = -1};
    s->before = calloc(TILES * (size_t)classes, sizeof *s->before);
    s->last = calloc(TILES, sizeof *s->last);
    s->sum = calloc(NAV_SEQUENCE_MOST * (size_t)classes, sizeof *s->sum);
    return s->before && s->last && s->sum ? 0 : -1;
}

void nav_sequence_free(struct nav_sequence *s)
{
    free(s->before);
    free(s->last);
    free(s->sum);
}

void nav_sequence_clear(struct nav_sequence *s)
{
    memset(s->before, 0, TILES * (size_t)s->classes * sizeof *s->before);
    for (int tile = 0; tile < TILES; tile++)
        s->last[tile].row = -1;
    s->visits = 0;
    memset(s->spread, 0, sizeof s->spread);
    s->begun = -1;
    s->weighed = -1;
}

void nav_sequence_copy(struct nav_sequence *to, const struct nav_sequence *from)
{
    float *before = to->before, *sum = to->sum;
    struct nav_sighting *last = to->last;
    *to = *from;
    to->before = before;
    to->sum = sum;
    to->last = last;
    memcpy(before, from->before, TILES * (size_t)from->classes * sizeof *before);
    memcpy(last, from->last, TILES * sizeof *last);
    memcpy(sum, from->sum, (size_t)from->visits * (size_t)from->classes * sizeof *sum);
}

/* Number of a tile; -1: beyond the lattice. */
static int sequence_tile(int column, int row)
{
    int c = column + NAV_FLOOR_SIDE / 2, r = row + NAV_FLOOR_SIDE / 2;
    return c < 0 || r < 0 || c >= NAV_FLOOR_SIDE || r >= NAV_FLOOR_SIDE ? -1 : r * NAV_FLOOR_SIDE + c;
}

static float *sequence_before(const struct nav_sequence *s, int tile)
{
    return s->before + (ptrdiff_t)tile * s->classes;
}

/* Frequencies of the textures on the tiles so far. */
static void sequence_frequencies(const struct nav_sequence *s, double *out)
{
    double count = s->classes;
    for (int k = 0; k < s->classes; k++)
        out[k] = 1.0;
    for (int tile = 0; tile < TILES; tile++) {
        const float *before = sequence_before(s, tile);
        int likeliest = 0;
        if (s->last[tile].row < 0)
            continue;
        for (int k = 1; k < s->classes; k++)
            likeliest = before[k] > before[likeliest] ? k : likeliest;
        out[likeliest] += 1.0;
        count += 1.0;
    }
    for (int k = 0; k < s->classes; k++)
        out[k] /= count;
}

/* Nats of a visit's windows for a tile as it was read before, over any tile: at most log(1 / frequency of its texture).
 */
static double sequence_nats(const struct nav_sequence *s, int visit, int tile, const double *frequency)
{
    const float *sum = s->sum + (ptrdiff_t)visit * s->classes, *before = tile < 0 ? NULL : sequence_before(s, tile);
    double most = -INFINITY, sure = -INFINITY, same = 0.0, any = 0.0, total = 0.0;
    if (!before || s->last[tile].row < 0)
        return 0.0;
    for (int k = 0; k < s->classes; k++) {
        most = fmax(most, (double)sum[k]);
        sure = fmax(sure, (double)before[k]);
    }
    for (int k = 0; k < s->classes; k++) {
        double window = exp((double)sum[k] - most), belief = frequency[k] * exp((double)before[k] - sure);
        same += belief * window;
        total += belief;
        any += frequency[k] * window;
    }
    return log((1.0 - WRONG) * same / total / any + WRONG);
}

/* Nats of the sequence, with the robot so many tiles from where it is believed to be. */
static double sequence_shifted(const struct nav_sequence *s, int columns, int rows, const double *frequency)
{
    double nats = 0.0;
    for (int n = 0; n < s->visits; n++) {
        const struct nav_sequence_visit *visit = &s->visit[n];
        nats += sequence_nats(s, n, sequence_tile(visit->column + columns, visit->row + rows), frequency);
    }
    return nats;
}

/* Density of being so many tiles off, before the sequence, over that of not being off. */
static double sequence_prior(const struct nav_sequence *s, double pitch, int columns, int rows)
{
    double u = pitch * columns, v = pitch * rows, least = 1e-6;
    double uu = s->spread[0] + least, vv = s->spread[2] + least, uv = s->spread[1], det = uu * vv - uv * uv;
    return exp(-0.5 * (vv * u * u - 2.0 * uv * u * v + uu * v * v) / det);
}

/* Probability that the tiles of the sequence are others. */
static double sequence_doubt(const struct nav_sequence *s, double pitch)
{
    double frequency[256], sum = 0.0, others = 0.0, alike = 0.0, same = 0.0;
    sequence_frequencies(s, frequency);
    for (int n = 0; n < SHIFTS; n++) {
        int columns = n % (2 * REACH + 1) - REACH, rows = n / (2 * REACH + 1) - REACH;
        double prior = sequence_prior(s, pitch, columns, rows), nats = sequence_shifted(s, columns, rows, frequency);
        sum += prior;
        if (!columns && !rows) {
            same = nats;
            continue;
        }
        others += prior * exp(nats);
        alike += exp(nats) / (SHIFTS - 1);
    }
    /* Astray, the robot is as likely where no map is as on any of the tiles about. */
    double odds = (1.0 - ASTRAY) * others / sum + ASTRAY * 0.5 * (1.0 + alike);
    return odds / (odds + (1.0 - ASTRAY) / sum * exp(same));
}

/* The visits become part of what is known of their tiles. */
void nav_sequence_end(struct nav_sequence *s)
{
    for (int n = 0; n < s->visits; n++) {
        float *before = sequence_before(s, sequence_tile(s->visit[n].column, s->visit[n].row));
        for (int k = 0; k < s->classes; k++)
            before[k] += s->sum[(ptrdiff_t)n * s->classes + k];
    }
    s->visits = 0;
    memset(s->spread, 0, sizeof s->spread);
}

/* What the visits so far say, of which the last is over. */
static void sequence_weigh(struct nav_sequence *s, const struct nav_particle_map *map)
{
    const struct nav_sequence_visit *visit = &s->visit[s->visits - 1];
    struct nav_closure c = {NAV_CLOSURE_TEXTURE, {.row = map->faces.row, .way = map->faces.way}, visit->then, 0.0};
    nav_floor_middle(&map->floor, &map->joint, visit->column, visit->row, &c.now.x, &c.now.y);
    c.doubt = sequence_doubt(s, map->joint.mean[NAV_JOINT_PITCH]);
    s->closure = c;
    s->weighed = c.now.row;
}

/* The visit of a tile in the sequence; -1: there is none. */
static int sequence_visit(const struct nav_sequence *s, int column, int row)
{
    for (int n = 0; n < s->visits; n++) {
        if (s->visit[n].column == column && s->visit[n].row == row)
            return n;
    }
    return -1;
}

/* Keeps the greatest spread of the last way. */
static void sequence_spread(struct nav_sequence *s, const struct nav_particle_map *map, double x, double y)
{
    double spread[3];
    nav_floor_spread(&map->floor, &map->joint, x, y, spread);
    if (spread[0] + spread[2] < s->spread[0] + s->spread[2] && map->faces.way - s->spread_way < GAP_M)
        return;
    memcpy(s->spread, spread, sizeof spread);
    s->spread_way = map->faces.way;
}

/* Begins a visit of a tile that is read again, where that tells of what had become unsure. Returns its number, or -1.
 */
static int sequence_begin(struct nav_sequence *s, int column, int row, const struct nav_sighting *last,
                          const struct nav_particle_map *map)
{
    if (last->row < 0 || map->faces.way - last->way <= NAV_CLOSURE_AWAY_M)
        return -1;
    if (s->visits)
        sequence_weigh(s, map);
    bool grown = s->spread[0] + s->spread[2] > 2.0 * NAV_CLOSURE_GROWN_M * NAV_CLOSURE_GROWN_M;
    if (!grown || s->visits == NAV_SEQUENCE_MOST)
        return -1;
    s->visit[s->visits] = (struct nav_sequence_visit){column, row, *last};
    memset(s->sum + (ptrdiff_t)s->visits * s->classes, 0, (size_t)s->classes * sizeof *s->sum);
    return s->visits++;
}

/* Takes a window of a tip at (x, y) of the robot. */
static void sequence_window(struct nav_sequence *s, const struct nav_particle_map *map, double x, double y,
                            const float *ratio)
{
    int column, row;
    double inside = nav_floor_at(&map->floor, &map->joint, x, y, &column, &row);
    int tile = sequence_tile(column, row), visit = sequence_visit(s, column, row);
    if (inside < INSIDE || tile < 0)
        return;
    struct nav_sighting now = {.row = map->faces.row, .way = map->faces.way};
    if (visit < 0)
        visit = sequence_begin(s, column, row, &s->last[tile], map);
    nav_floor_middle(&map->floor, &map->joint, column, row, &now.x, &now.y);
    float *sum = visit < 0 ? sequence_before(s, tile) : s->sum + (ptrdiff_t)visit * s->classes;
    for (int k = 0; k < s->classes; k++)
        sum[k] += logf(ratio[k]);
    if (visit >= 0)
        s->read_way = now.way;
    s->last[tile] = now;
}

void nav_sequence_take(struct nav_sequence *s, const struct nav_particle_map *map, const struct nav_record *r,
                       const struct nav_record_row *row)
{
    if (!map->floor.known)
        return;
    if (s->begun != map->floor.begun) {
        nav_sequence_clear(s);
        s->begun = map->floor.begun;
    }
    if (s->visits && map->faces.way - s->read_way > GAP_M) {
        sequence_weigh(s, map);
        nav_sequence_end(s);
    }
    for (int tip = 0; tip < r->tips; tip++) {
        const float *window = row->window + (ptrdiff_t)tip * (1 + r->classes);
        const struct nav_tip *at = &r->problem->robot.tip[tip];
        if (!tip && !s->visits)
            sequence_spread(s, map, at->x, at->y);
        if (window[0] >= 0.0F)
            sequence_window(s, map, at->x, at->y, window + 1);
    }
}

size_t nav_sequence_bytes(int classes)
{
    size_t tile = (size_t)classes * sizeof(float) + sizeof(struct nav_sighting);
    return TILES * tile + NAV_SEQUENCE_MOST * (size_t)classes * sizeof(float);
}
