#include "mixture.h"

#include <math.h>
#include <stdlib.h>

static int floor_div(int a, int b)
{
    return a >= 0 ? a / b : -((b - 1 - a) / b);
}

/* Number of the layer of `cell` that holds this one. */
static size_t layer_of(const struct nav_mixture *m, const struct nav_layer *layer)
{
    int px = layer->x - m->sub * floor_div(layer->x, m->sub), py = layer->y - m->sub * floor_div(layer->y, m->sub);
    return ((size_t)layer->heading * (size_t)m->sub + (size_t)py) * (size_t)m->sub + (size_t)px;
}

static size_t layers(const struct nav_mixture *m)
{
    return (size_t)m->nh * (size_t)m->sub * (size_t)m->sub;
}

/* Largest likelihood among signatures, for a scale that single precision can hold. */
static double best_of(const double *value, uint32_t count)
{
    enum { LANES = 8 };
    double best[LANES] = {0.0};
    uint32_t n = 0;
    for (; n + LANES <= count; n += LANES) {
        for (uint32_t k = 0; k < LANES; k++)
            best[k] = value[n + k] > best[k] ? value[n + k] : best[k];
    }
    for (; n < count; n++)
        best[0] = fmax(best[0], value[n]);
    for (int k = 1; k < LANES; k++)
        best[0] = fmax(best[0], best[k]);
    return best[0];
}

void nav_mixture_begin(struct nav_mixture *m, const struct nav_expected *e)
{
    uint32_t count = e->signatures - 1;
    double best = best_of(e->value, count), scale = best > 0.0 ? 1.0 / best : 0.0;
    for (uint32_t n = 0; n < count; n++)
        m->part_value[n] = (float)(e->value[n] * scale);
    m->present++;
}

static float work_out(const struct nav_mixture *m, const struct nav_mix *mix)
{
    float sum = 0.0f;
    for (uint32_t i = mix->first; i < mix->end; i++)
        sum += m->part[i].share * m->part_value[m->part[i].signature];
    return sum;
}

void nav_mixture_work_out(struct nav_mixture *m, const struct nav_layer *layer)
{
    size_t n = layer_of(m, layer) * (size_t)m->bands;
    for (uint32_t i = m->listed[n]; i < m->listed[n + (size_t)m->bands]; i++) {
        struct nav_mix *mix = &m->mix[m->list[i]];
        if (mix->row != m->present) {
            mix->row = m->present;
            mix->value = work_out(m, mix);
        }
        m->listed_value[i] = mix->value;
    }
}

/* A row of a layer: places of its cells' mixes in a band's list, and where that list begins. */
struct row {
    const uint16_t *cell;
    uint32_t listed;
};

static struct row row_of(const struct nav_mixture *m, const struct nav_layer *layer, int row)
{
    int x = 1 + floor_div(layer->x, m->sub), y = 1 + row + floor_div(layer->y, m->sub);
    size_t n = layer_of(m, layer);
    return (struct row){m->cell + ((ptrdiff_t)n * (m->ny + 2) + y) * m->pitch + x,
                        m->listed[n * (size_t)m->bands + (size_t)(y / m->band)]};
}

const struct nav_mix *nav_mixture_at(const struct nav_mixture *m, const struct nav_layer *layer, int i, int j)
{
    struct row row = row_of(m, layer, j);
    return &m->mix[m->list[row.listed + row.cell[i]]];
}

void nav_mixture_look_up(const struct nav_mixture *m, const struct nav_layer *layer, int j, int begin, int end,
                         float *out)
{
    struct row row = row_of(m, layer, j);
    const float *value = m->listed_value + row.listed;
    const uint16_t *cell = row.cell;
    for (int i = begin; i < end; i++)
        out[i] = value[cell[i]];
}

void nav_mixture_free(struct nav_mixture *m)
{
    if (!m)
        return;
    free(m->cell);
    free(m->mix);
    free(m->part);
    free(m->listed);
    free(m->list);
    free(m->listed_value);
    free(m->part_value);
    free(m->begin);
    free(m->end);
    free(m);
}

size_t nav_mixture_bytes(const struct nav_mixture *m)
{
    size_t lists = layers(m) * (size_t)m->bands, cells = layers(m) * (size_t)m->pitch * (size_t)(m->ny + 2);
    size_t parts = m->mix[m->count - 1].end, listed = m->listed[lists];
    return cells * sizeof *m->cell + m->count * sizeof *m->mix + parts * sizeof *m->part +
           (lists + 2 * listed) * sizeof(uint32_t);
}
