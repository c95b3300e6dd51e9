#include "texture_catch.h"

#include <math.h>

static double mean_of(const struct nav_texture_catch *c, const double *window, int n, int channel)
{
    double sum = 0.0;
    for (int i = 0; i < n; i++)
        sum += window[(long)i * c->channels + channel];
    return sum / n;
}

static bool away(const struct nav_texture_catch *c, const double *window, int n)
{
    for (int k = 0; k < c->channels; k++) {
        if (fabs(mean_of(c, window, n, k) - c->level[k]) > c->span[k])
            return true;
    }
    return false;
}

bool nav_texture_catch_follow(struct nav_texture_catch *c, const double *window, int n, int fresh, bool sudden)
{
    if (!c->span)
        return sudden;
    c->samples = c->held ? c->samples + fresh : 0;
    c->held = sudden || (c->held && c->known && c->samples < c->patience && away(c, window, n));
    if (!c->held) {
        for (int k = 0; k < c->channels; k++)
            c->level[k] = mean_of(c, window, n, k);
        c->known = true;
    }
    return c->held;
}
