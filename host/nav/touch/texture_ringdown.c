#include "texture_ringdown.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "texture_features.h"

enum { LEAST = NAV_TEXTURE_RINGDOWN_LEAST, MOST = NAV_TEXTURE_RINGDOWN_MOST };
#define TINY 1e-12 /* counts squared: what is silent has a logarithm too */

struct nav_texture_ringdown {
    int channels, length, held;
    double floor[NAV_TEXTURE_CHANNELS_MAX], limit[NAV_TEXTURE_RINGDOWN_LIMITS];
    double loud[MOST]; /* log power of the blocks held, the newest last */
};

static bool all_positive(const double *value, int n)
{
    for (int i = 0; i < n; i++) {
        if (!isfinite(value[i]) || !(value[i] > 0.0))
            return false;
    }
    return true;
}

struct nav_texture_ringdown *nav_texture_ringdown_new(const struct nav_texture_ringdown_numbers *n)
{
    bool ok = n->channels >= 1 && n->channels <= NAV_TEXTURE_CHANNELS_MAX && n->length >= 2 &&
              all_positive(n->limit, NAV_TEXTURE_RINGDOWN_LIMITS);
    struct nav_texture_ringdown *s = ok ? calloc(1, sizeof *s) : NULL;
    if (!s)
        return NULL;
    s->channels = n->channels;
    s->length = n->length;
    memcpy(s->limit, n->limit, sizeof s->limit);
    for (int c = 0; c < n->channels; c++)
        s->floor[c] = fmax(n->floor[c], 0.0) + TINY;
    return s;
}

void nav_texture_ringdown_free(struct nav_texture_ringdown *s)
{
    free(s);
}

int nav_texture_ringdown_length(const struct nav_texture_ringdown *s)
{
    return s->length;
}

void nav_texture_ringdown_reset(struct nav_texture_ringdown *s)
{
    s->held = 0;
}

static double power(const struct nav_texture_ringdown *s, const double *block, int channel)
{
    double first = block[channel], sum = 0.0,
           squares = 0.0; /* from the first sample, so that an offset costs no digits */
    for (int i = 0; i < s->length; i++) {
        double x = block[(long)i * s->channels + channel] - first;
        sum += x;
        squares += x * x;
    }
    return fmax(squares - sum * sum / s->length, 0.0) / s->length;
}

void nav_texture_ringdown_take(struct nav_texture_ringdown *s, const double *block)
{
    double loud = 0.0;
    for (int c = 0; c < s->channels; c++)
        loud += log(power(s, block, c) + s->floor[c]) / s->channels;
    if (s->held == MOST)
        memmove(s->loud, s->loud + 1, (size_t)--s->held * sizeof *s->loud);
    s->loud[s->held++] = loud;
}

double nav_texture_ringdown_fall(const struct nav_texture_ringdown *s, int blocks)
{
    if (blocks < LEAST || blocks > s->held)
        return 0.0;
    double slope = 0.0, weight = 0.0;
    for (int b = 0; b < blocks; b++) {
        double at = b - 0.5 * (blocks - 1);
        slope += at * s->loud[s->held - blocks + b];
        weight += at * at;
    }
    return -slope / weight;
}

int nav_texture_ringdown_rings(const struct nav_texture_ringdown *s)
{
    return s->held >= LEAST && nav_texture_ringdown_fall(s, s->held) > s->limit[s->held - LEAST];
}
