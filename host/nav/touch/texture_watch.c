#include "texture_watch.h"

#include <stdlib.h>
#include <string.h>

#define BAD_SHARE_MOST 0.25 /* of a window; with more, its spectrum is that of the gaps */

bool nav_texture_watch_make(struct nav_texture_watch *w, const struct nav_texture_rules *rules,
                            const struct nav_texture_limits *limits)
{
    *w = (struct nav_texture_watch){
        .channels = rules->channels, .limits = limits, .change = rules->change, .ringdown = rules->ringdown};
    size_t length = w->change ? (size_t)nav_texture_change_length(w->change) : 1;
    w->block = calloc(length * (size_t)w->channels, sizeof *w->block);
    return w->block;
}

void nav_texture_watch_free(struct nav_texture_watch *w)
{
    free(w->block);
}

static void interrupt(struct nav_texture_watch *w)
{
    if (w->change)
        nav_texture_change_keep(w->change, 0);
    if (w->ringdown)
        nav_texture_ringdown_reset(w->ringdown);
}

void nav_texture_watch_reset(struct nav_texture_watch *w)
{
    w->blocked = 0;
    interrupt(w);
}

bool nav_texture_unreadable(const struct nav_texture_health *h, int n)
{
    return (double)h->bad > BAD_SHARE_MOST * n || h->still > 0 || h->railed > 0;
}

int nav_texture_watch_take(struct nav_texture_watch *w, const double *sample, bool held)
{
    if (!w->change)
        return 0;
    memcpy(w->block + w->blocked++ * w->channels, sample, (size_t)w->channels * sizeof *sample);
    int length = nav_texture_change_length(w->change), after;
    if (w->blocked < length)
        return 0;
    w->blocked = 0;
    struct nav_texture_health health = nav_texture_clean(w->block, length, w->limits);
    if (nav_texture_unreadable(&health, length) || health.caught > 0 || held) {
        interrupt(w);
        return 0;
    }
    if (w->ringdown)
        nav_texture_ringdown_take(w->ringdown, w->block);
    if (!(nav_texture_change_weigh(w->change, w->block, &after) > nav_texture_change_limit(w->change)))
        return 0;
    nav_texture_change_keep(w->change, after);
    return after * length;
}
