#include "adaptive_sense.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double EDGE_M = 0.1;
static const double SQUARES_MOST = 65536.0;

static size_t squares(const struct adaptive_sense *s)
{
    return (size_t)s->rows * (size_t)s->columns;
}

/* Farthest point from the robot's centre that matters to it. */
static double reach_of(const struct adaptive_sense *s)
{
    double reach = s->robot->body_radius;
    for (int r = 0; r < s->robot->rays; r++) {
        const struct nav_model *model = &s->likelihood->model[s->robot->tips + r];
        const struct nav_ray *ray = &s->robot->ray[r];
        reach = fmax(reach, hypot(ray->x, ray->y) + (model->codes - 1) * model->step);
    }
    return reach;
}

static bool near_box(const struct adaptive_sense *s, size_t square, const struct nav_box *box, double reach)
{
    double x0 = (double)(square % (size_t)s->columns) * s->edge, y0 = (double)(square / (size_t)s->columns) * s->edge;
    double dx = fmax(fmax(box->x0 - x0 - s->edge, x0 - box->x1), 0.0);
    double dy = fmax(fmax(box->y0 - y0 - s->edge, y0 - box->y1), 0.0);
    return dx * dx + dy * dy <= reach * reach;
}

static bool near_wall(const struct adaptive_sense *s, size_t square, double reach)
{
    double x0 = (double)(square % (size_t)s->columns) * s->edge, y0 = (double)(square / (size_t)s->columns) * s->edge;
    return x0 <= reach || y0 <= reach || x0 + s->edge >= s->arena->size_x - reach ||
           y0 + s->edge >= s->arena->size_y - reach;
}

/* Two passes over squares and boxes: count, then copy. */
static int map_squares(struct adaptive_sense *s)
{
    double reach = reach_of(s);
    for (size_t n = 0; n < squares(s); n++) {
        s->wall[n] = near_wall(s, n, reach);
        s->first[n + 1] = s->first[n];
        for (int b = 0; b < s->arena->boxes; b++)
            s->first[n + 1] += near_box(s, n, &s->arena->box[b], reach);
    }
    s->box = calloc((size_t)s->first[squares(s)] + 1, sizeof *s->box);
    if (!s->box)
        return -1;
    struct nav_box *out = s->box;
    for (size_t n = 0; n < squares(s); n++) {
        for (int b = 0; b < s->arena->boxes; b++) {
            if (near_box(s, n, &s->arena->box[b], reach))
                *out++ = s->arena->box[b];
        }
    }
    return 0;
}

static int make_book(struct adaptive_sense *s, size_t most)
{
    for (s->slots = 64; s->slots < 2 * most; s->slots *= 2)
        ;
    size_t width = (size_t)s->likelihood->whiskers + 1;
    s->stamp = calloc(s->slots, sizeof *s->stamp);
    s->codes = calloc(s->slots, width);
    s->value = calloc(s->slots, sizeof *s->value);
    s->filled = calloc(s->slots, sizeof *s->filled);
    s->mass = calloc(s->slots, sizeof *s->mass);
    s->scratch = calloc(width, 1);
    return s->filled && s->mass && s->stamp && s->codes && s->value && s->scratch ? 0 : -1;
}

int adaptive_sense_init(struct adaptive_sense *s, const struct nav_problem *problem, size_t most)
{
    const struct nav_arena *arena = &problem->arena;
    *s = (struct adaptive_sense){.arena = arena, .robot = &problem->robot};
    s->edge = fmax(EDGE_M, sqrt(arena->size_x * arena->size_y / SQUARES_MOST));
    s->columns = (int)ceil(arena->size_x / s->edge);
    s->rows = (int)ceil(arena->size_y / s->edge);
    s->likelihood = nav_likelihood_new(arena, s->robot, &problem->settings, 0.0);
    s->bearing = calloc((size_t)s->robot->rays * 2 + 1, sizeof *s->bearing);
    s->first = calloc(squares(s) + 1, sizeof *s->first);
    s->wall = calloc(squares(s) + 1, 1);
    if (!s->likelihood || !s->bearing || !s->first || !s->wall || map_squares(s) || make_book(s, most))
        return -1;
    for (int r = 0; r < s->robot->rays; r++) {
        s->bearing[2 * r] = cos(s->robot->ray[r].yaw);
        s->bearing[2 * r + 1] = sin(s->robot->ray[r].yaw);
    }
    return 0;
}

void adaptive_sense_free(struct adaptive_sense *s)
{
    nav_likelihood_free(s->likelihood);
    free(s->bearing);
    free(s->first);
    free(s->box);
    free(s->wall);
    free(s->stamp);
    free(s->codes);
    free(s->value);
    free(s->filled);
    free(s->mass);
    free(s->scratch);
}

void adaptive_sense_read(struct adaptive_sense *s, const struct nav_evidence *evidence)
{
    s->evidence = evidence;
    nav_likelihood_read(s->likelihood, evidence);
    s->distinct = 0;
    if (++s->row == 0) { /* the stamps of 2^32 rows ago would look fresh */
        memset(s->stamp, 0, s->slots * sizeof *s->stamp);
        s->row = 1;
    }
}

static int index_of(double position, int count)
{
    return position > 0.0 ? (position < count ? (int)position : count - 1) : 0;
}

/* Number of the square under (x, y), or of the nearest. */
static size_t square_at(const struct adaptive_sense *s, double x, double y)
{
    double per_m = 1.0 / s->edge;
    return (size_t)index_of(y * per_m, s->rows) * (size_t)s->columns + (size_t)index_of(x * per_m, s->columns);
}

/* Whether a square has nothing solid within reach. */
static bool empty(const struct adaptive_sense *s, size_t square)
{
    return s->first[square] == s->first[square + 1] && !s->wall[square];
}

/* The arena with the boxes near a square alone. */
static struct nav_arena around(const struct adaptive_sense *s, size_t square)
{
    struct nav_arena near = *s->arena;
    near.boxes = (int)(s->first[square + 1] - s->first[square]);
    near.box = s->box + s->first[square];
    return near;
}

static void codes_of_rays(const struct adaptive_sense *s, double x, double y, double c, double d, uint8_t *codes)
{
    const struct nav_likelihood *l = s->likelihood;
    size_t square = square_at(s, x, y);
    if (empty(s, square)) {
        for (int w = l->tips; w < l->whiskers; w++)
            codes[w] = (uint8_t)(l->model[w].codes - 1);
        return;
    }
    struct nav_arena near = around(s, square);
    for (int r = 0; r < s->robot->rays; r++) {
        const struct nav_ray *ray = &s->robot->ray[r];
        const struct nav_model *model = &l->model[l->tips + r];
        const double *b = s->bearing + 2 * r;
        double range =
            nav_arena_range_along(&near, x + c * ray->x - d * ray->y, y + d * ray->x + c * ray->y, c * b[0] - d * b[1],
                                  d * b[0] + c * b[1], (model->codes - 1) * model->step);
        codes[l->tips + r] = nav_likelihood_range_code(model, range);
    }
}

void adaptive_sense_codes(const struct adaptive_sense *s, double x, double y, double c, double d, uint8_t *codes)
{
    for (int t = 0; t < s->robot->tips; t++) {
        const struct nav_tip *tip = &s->robot->tip[t];
        codes[t] = (uint8_t)nav_arena_texture(s->arena, x + c * tip->x - d * tip->y, y + d * tip->x + c * tip->y);
    }
    codes_of_rays(s, x, y, c, d, codes);
}

static bool alike(const uint8_t *a, const uint8_t *b, size_t width)
{
    size_t w = 0;
    while (w < width && a[w] == b[w])
        w++;
    return w == width;
}

static size_t slot_of(struct adaptive_sense *s, const uint8_t *codes, size_t width)
{
    uint64_t h = 14695981039346656037u; /* FNV-1a */
    for (size_t w = 0; w < width; w++)
        h = (h ^ codes[w]) * 1099511628211u;
    size_t slot = (size_t)(h ^ (h >> 29)) & (s->slots - 1);
    while (s->stamp[slot] == s->row && !alike(s->codes + slot * width, codes, width))
        slot = (slot + 1) & (s->slots - 1);
    return slot;
}

uint32_t adaptive_sense_at(struct adaptive_sense *s, double x, double y, double c, double d)
{
    size_t width = (size_t)s->likelihood->whiskers;
    adaptive_sense_codes(s, x, y, c, d, s->scratch);
    /* A whisker that was not read tells no two hypotheses apart. */
    for (size_t w = 0; w < width; w++)
        s->scratch[w] = s->evidence->weight[w] > 0.0 ? s->scratch[w] : 0;
    size_t slot = slot_of(s, s->scratch, width);
    if (s->stamp[slot] != s->row) {
        s->stamp[slot] = s->row;
        memcpy(s->codes + slot * width, s->scratch, width);
        s->value[slot] = nav_likelihood_of(s->likelihood, s->scratch);
        s->filled[s->distinct++] = (uint32_t)slot;
    }
    return (uint32_t)slot;
}

bool adaptive_sense_free_at(const struct adaptive_sense *s, double x, double y, double grace)
{
    size_t square = square_at(s, x, y);
    if (empty(s, square))
        return true;
    struct nav_arena near = around(s, square);
    return nav_arena_free(&near, x, y, fmax(s->robot->body_radius - grace, 0.0));
}

size_t adaptive_sense_bytes(const struct adaptive_sense *s)
{
    size_t entry =
        sizeof *s->stamp + sizeof *s->filled + sizeof *s->mass + sizeof *s->value + (size_t)s->likelihood->whiskers;
    return squares(s) * (sizeof *s->first + 1) + s->first[squares(s)] * sizeof *s->box + s->slots * entry;
}
