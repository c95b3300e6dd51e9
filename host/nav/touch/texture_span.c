#include "texture_span.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

struct nav_texture_span {
    int channels, classes, rungs;
    struct nav_texture_rung *rung[NAV_TEXTURE_RUNGS_MAX];
    double growth;
    double *part; /* [classes] of one rung's window */
};

struct nav_texture_span *nav_texture_span_new(const struct nav_texture_rules *rules)
{
    struct nav_texture_span *s = calloc(1, sizeof *s);
    if (!s)
        return NULL;
    s->channels = rules->channels;
    s->classes = rules->classes;
    s->rungs = rules->rungs;
    s->growth = rules->growth;
    memcpy(s->rung, rules->rung, (size_t)rules->rungs * sizeof *s->rung);
    s->part = calloc((size_t)s->classes, sizeof *s->part);
    if (!s->part) {
        free(s);
        return NULL;
    }
    return s;
}

void nav_texture_span_free(struct nav_texture_span *s)
{
    if (!s)
        return;
    free(s->part);
    free(s);
}

static int longest_within(const struct nav_texture_span *s, int n)
{
    int rung = s->rungs - 1;
    while (rung >= 0 && nav_texture_rung_length(s->rung[rung]) > n)
        rung--;
    return rung;
}

/* Evidence grows with length; the largest log-likelihood becomes 0. */
static void finish(const struct nav_texture_span *s, double *loglik, int windows, double lengths)
{
    double best = -INFINITY, factor = pow(lengths, s->growth) / windows;
    for (int k = 0; k < s->classes; k++)
        best = fmax(best, loglik[k]);
    for (int k = 0; k < s->classes; k++)
        loglik[k] = (loglik[k] - best) * factor;
}

int nav_texture_span_judge(struct nav_texture_span *s, const double *window, int n, double *loglik)
{
    int rung = longest_within(s, n);
    memset(loglik, 0, (size_t)s->classes * sizeof *loglik);
    if (rung < 0)
        return -1;
    int length = nav_texture_rung_length(s->rung[rung]);
    int windows = (n + length - 1) / length;
    for (int w = 0; w < windows; w++) {
        long start = windows > 1 ? (long)(n - length) * w / (windows - 1) : 0;
        nav_texture_rung_judge(s->rung[rung], window + (size_t)start * (size_t)s->channels, s->part);
        for (int k = 0; k < s->classes; k++)
            loglik[k] += s->part[k];
    }
    finish(s, loglik, windows, (double)n / length);
    return rung;
}
