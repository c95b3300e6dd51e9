/* Building the table of mixes: once per filter. */
#include <stdlib.h>
#include <string.h>

#include "book.h"
#include "mixture.h"

struct maker {
    struct nav_mixture *m;
    const struct nav_expected *e;
    struct nav_book book;
    uint32_t *cell; /* as the table's cells, but the book's numbers, then those in order of parts */
    uint32_t *key;  /* [sub^2 turns] signatures of one cell's sub-poses, sorted */
    uint32_t *old;  /* the book's number of a mix */
    int parts;
};

static size_t all_cells(const struct nav_mixture *m)
{
    return (size_t)(m->nh * m->sub * m->sub) * (size_t)m->pitch * (size_t)(m->ny + 2);
}

static int by_number(const void *a, const void *b)
{
    uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
    return x < y ? -1 : x > y;
}

/* Sorts few numbers, mostly equal ones. */
static void sort(uint32_t *key, int n)
{
    if (n > 64) {
        qsort(key, (size_t)n, sizeof *key, by_number);
        return;
    }
    for (int i = 1; i < n; i++) {
        uint32_t k = key[i];
        int j = i;
        for (; j > 0 && key[j - 1] > k; j--)
            key[j] = key[j - 1];
        key[j] = k;
    }
}

/* Mix of the cell whose sub-poses start at (i, j) in heading k. */
static uint32_t mix_at(struct maker *w, int i, int j, int k)
{
    int sub = w->m->sub, n = 0;
    for (int c = 0; c < w->m->turns; c++) {
        for (int b = 0; b < sub; b++) {
            const uint32_t *signature = nav_expected_row(w->e, (k + c) % w->e->nh, j + b) + i;
            for (int a = 0; a < sub; a++)
                w->key[n++] = signature[a];
        }
    }
    sort(w->key, n);
    return nav_book_number(&w->book, w->key);
}

static int survey(struct maker *w)
{
    struct nav_mixture *m = w->m;
    uint32_t *cell = w->cell;
    memset(w->key, 0, (size_t)w->parts * sizeof *w->key);
    if (nav_book_number(&w->book, w->key) != 0)
        return -1;
    for (int layer = 0; layer < m->nh * m->sub * m->sub; layer++) {
        int k = layer / m->sub / m->sub, py = layer / m->sub % m->sub, px = layer % m->sub;
        for (int j = -1; j <= m->ny; j++) {
            for (int i = -1; i <= m->nx; i++) {
                *cell = mix_at(w, i * m->sub + px, j * m->sub + py, k);
                if (*cell++ == NAV_BOOK_FULL)
                    return -1;
            }
        }
    }
    return 0;
}

/* Parts of a mix: equal signatures joined. With `part` NULL they are counted only. */
static uint32_t unpack(const struct maker *w, uint32_t mix, struct nav_part *part)
{
    const uint32_t *key = nav_book_key(&w->book, mix);
    uint32_t parts = 0;
    for (int i = 0, run; i < w->parts; i += run) {
        for (run = 1; i + run < w->parts && key[i + run] == key[i]; run++)
            ;
        if (key[i] == 0)
            continue;
        if (part)
            part[parts] = (struct nav_part){key[i] - 1, (float)run / (float)w->parts};
        parts++;
    }
    return parts;
}

/* A mix's number when they are ordered by their parts, so that working out many of them meets long runs of equal
 * loops. order[old] = new. */
static int order_by_parts(const struct maker *w, uint32_t *order)
{
    uint32_t count = w->book.count, next = 0;
    for (uint32_t parts = 0; parts <= (uint32_t)w->parts; parts++) {
        for (uint32_t n = 0; n < count; n++) {
            if (unpack(w, n, NULL) == parts)
                order[n] = next++;
        }
    }
    return next == count ? 0 : -1;
}

static int renumber(struct maker *w)
{
    struct nav_mixture *m = w->m;
    size_t cells = all_cells(m);
    uint32_t *order = calloc(w->book.count, sizeof *order);
    w->old = calloc(w->book.count, sizeof *w->old);
    if (!order || !w->old || order_by_parts(w, order)) {
        free(order);
        return -1;
    }
    for (uint32_t n = 0; n < w->book.count; n++)
        w->old[order[n]] = n;
    for (size_t i = 0; i < cells; i++)
        w->cell[i] = order[w->cell[i]];
    free(order);
    return 0;
}

static int unpack_all(struct maker *w)
{
    struct nav_mixture *m = w->m;
    uint32_t parts = 0;
    m->count = w->book.count;
    m->mix = calloc(m->count, sizeof *m->mix);
    m->part_value = calloc(w->e->signatures, sizeof *m->part_value);
    if (!m->mix || !m->part_value)
        return -1;
    for (uint32_t n = 0; n < m->count; n++) {
        m->mix[n].first = parts;
        m->mix[n].end = parts += unpack(w, w->old[n], NULL);
    }
    m->part = calloc((size_t)parts + 1, sizeof *m->part);
    for (uint32_t n = 0; m->part && n < m->count; n++)
        unpack(w, w->old[n], m->part + m->mix[n].first);
    return m->part ? 0 : -1;
}

/* Lists the mixes that occur in one band of cells and numbers its cells by the list. place[mix]: scratch, all
 * UINT32_MAX before and after. */
static uint32_t list_band(struct maker *w, size_t cell, size_t cells, uint32_t *place, uint32_t *list)
{
    uint32_t found = 0;
    for (size_t i = cell; i < cell + cells; i++) {
        if (place[w->cell[i]] != UINT32_MAX)
            continue;
        place[w->cell[i]] = found;
        list[found++] = w->cell[i];
    }
    qsort(list, found, sizeof *list, by_number);
    for (uint32_t n = 0; n < found; n++)
        place[list[n]] = n;
    for (size_t i = cell; i < cell + cells; i++)
        w->m->cell[i] = (uint16_t)place[w->cell[i]];
    for (uint32_t n = 0; n < found; n++)
        place[list[n]] = UINT32_MAX;
    return found;
}

static int list_bands(struct maker *w, uint32_t *place, uint32_t *list)
{
    struct nav_mixture *m = w->m;
    size_t cell = 0, bands = (size_t)(m->nh * m->sub * m->sub) * (size_t)m->bands, room = 0;
    for (size_t n = 0; n < bands; n++) {
        int rows = m->ny + 2 - (int)(n % (size_t)m->bands) * m->band;
        size_t cells = (size_t)(rows < m->band ? rows : m->band) * (size_t)m->pitch;
        uint32_t found = list_band(w, cell, cells, place, list);
        cell += cells;
        m->listed[n + 1] = m->listed[n] + found;
        if (m->listed[n + 1] > room) {
            room = 2 * (size_t)m->listed[n + 1];
            uint32_t *grown = realloc(m->list, room * sizeof *m->list);
            if (!grown)
                return -1;
            m->list = grown;
        }
        memcpy(m->list + m->listed[n], list, found * sizeof *list);
    }
    m->listed_value = calloc(m->listed[bands], sizeof *m->listed_value);
    return m->listed_value ? 0 : -1;
}

static int list_all(struct maker *w)
{
    struct nav_mixture *m = w->m;
    m->band = UINT16_MAX / (int)m->pitch > m->ny + 2 ? m->ny + 2 : UINT16_MAX / (int)m->pitch;
    m->bands = (m->ny + 2 + m->band - 1) / m->band;
    m->cell = calloc(all_cells(m), sizeof *m->cell);
    m->listed = calloc((size_t)(m->nh * m->sub * m->sub) * (size_t)m->bands + 1, sizeof *m->listed);
    uint32_t *place = malloc(m->count * sizeof *place), *list = calloc(m->count, sizeof *list);
    for (uint32_t n = 0; place && n < m->count; n++)
        place[n] = UINT32_MAX;
    int failed = !m->cell || !m->listed || !place || !list || list_bands(w, place, list);
    free(place);
    free(list);
    return failed;
}

/* Free space does not depend on the heading, and a slice's shift reaches one cell to either side, so cells as they lie
 * unshifted in one heading tell which may ever be free. */
static int find_spans(const struct maker *w)
{
    struct nav_mixture *m = w->m;
    m->begin = calloc((size_t)m->ny, sizeof *m->begin);
    m->end = calloc((size_t)m->ny, sizeof *m->end);
    if (!m->begin || !m->end)
        return -1;
    for (int j = 0; j < m->ny; j++) {
        m->begin[j] = m->nx;
        for (int i = 0; i < 3 * (m->nx + 2); i++) {
            int x = i % (m->nx + 2) - 1, y = j + i / (m->nx + 2) - 1;
            if (w->cell[(size_t)(y + 1) * (size_t)m->pitch + (size_t)(x + 1)] == 0)
                continue;
            m->begin[j] = x - 1 < m->begin[j] ? x - 1 : m->begin[j];
            m->end[j] = x + 2 > m->end[j] ? x + 2 : m->end[j];
        }
        m->begin[j] = m->begin[j] < 0 ? 0 : m->begin[j];
        m->end[j] = m->end[j] > m->nx ? m->nx : m->end[j];
    }
    return 0;
}

struct nav_mixture *nav_mixture_new(const struct nav_expected *e, int nx, int ny, int sub, int turns)
{
    struct nav_mixture *m = calloc(1, sizeof *m);
    if (!m)
        return NULL;
    *m = (struct nav_mixture){.nx = nx, .ny = ny, .pitch = nx + 2, .sub = sub, .turns = turns, .nh = e->nh};
    struct maker w = {.m = m, .e = e, .parts = sub * sub * turns};
    w.book.width = (size_t)w.parts * sizeof *w.key;
    w.key = calloc((size_t)w.parts, sizeof *w.key);
    w.cell = calloc(all_cells(m), sizeof *w.cell);
    int failed = !w.key || !w.cell || survey(&w) || renumber(&w) || unpack_all(&w) || list_all(&w) || find_spans(&w);
    free(w.cell);
    free(w.key);
    free(w.old);
    nav_book_free(&w.book);
    if (!failed)
        return m;
    nav_mixture_free(m);
    return NULL;
}
