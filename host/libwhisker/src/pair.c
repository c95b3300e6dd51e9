#include "whisker/pair.h"

#include <string.h>

#include "whisker/errors.h"

#define USB_TIME_KNOWN 0x8000u
#define MICROFRAMES 0x4000u /* after so many they count anew */

void whisker_pair_init(struct whisker_pair *pair, uint32_t tick_period)
{
    memset(pair, 0, sizeof *pair);
    pair->tick_period = tick_period;
    pair->running[0] = pair->running[1] = pair->searching = true;
}

void whisker_pair_run(struct whisker_pair *pair, int bridge, bool running)
{
    pair->running[bridge] = running;
    pair->searching = true;
    pair->blind = false;
}

static struct whisker_frame *pair_held(struct whisker_pair *pair, int bridge, unsigned i)
{
    return &pair->held[bridge][(pair->first[bridge] + i) % WHISKER_PAIR_HELD];
}

int whisker_pair_add(struct whisker_pair *pair, int bridge, const struct whisker_frame *frame)
{
    if (bridge < 0 || bridge > 1 || pair->count[bridge] == WHISKER_PAIR_HELD) {
        return WHISKER_ERROR_ARGUMENT;
    }
    *pair_held(pair, bridge, pair->count[bridge]++) = *frame;
    pair->searching |= pair->silent[bridge]; /* it may have missed edges */
    pair->silent[bridge] = false;
    return WHISKER_OK;
}

/* The tick of a held frame, as the first bridge counts. */
static int64_t pair_tick_of(struct whisker_pair *pair, int bridge, unsigned i)
{
    return (int64_t)pair_held(pair, bridge, i)->tick + (bridge ? pair->offset : 0);
}

static void pair_take(struct whisker_pair *pair, int bridge, struct whisker_frame *frame)
{
    *frame = *pair_held(pair, bridge, 0);
    if (bridge) {
        frame->tick += (uint64_t)pair->offset;
        frame->time_cycles += (uint64_t)pair->offset * pair->tick_period;
        frame->flags |= WHISKER_FRAME_SECOND;
    }
    frame->sequence = (uint32_t)(2 * frame->tick) + (uint32_t)bridge;
    pair->first[bridge] = (pair->first[bridge] + 1) % WHISKER_PAIR_HELD;
    pair->count[bridge]--;
}

static bool pair_usb_time_known(const struct whisker_frame *a, const struct whisker_frame *b)
{
    return (a->flags & b->flags) >> WHISKER_FRAME_USB_TIME_SHIFT & USB_TIME_KNOWN;
}

static bool pair_is_apart(const struct whisker_frame *a, const struct whisker_frame *b)
{
    const unsigned at = a->flags >> WHISKER_FRAME_USB_TIME_SHIFT, other = b->flags >> WHISKER_FRAME_USB_TIME_SHIFT;
    const unsigned later = (at - other) % MICROFRAMES;
    return pair_usb_time_known(a, b) && later > 1 && later < MICROFRAMES - 1;
}

/* Looks for the second's oldest frame among the first's, then for the first's oldest among the second's. */
static bool pair_find_offset(struct whisker_pair *pair, int64_t *offset)
{
    for (int bridge = 0; bridge < 2; bridge++) {
        const struct whisker_frame *wanted = pair_held(pair, !bridge, 0);
        for (unsigned i = 0; i < pair->count[bridge]; i++) {
            const struct whisker_frame *frame = pair_held(pair, bridge, i);
            if (pair_usb_time_known(frame, wanted) && !pair_is_apart(frame, wanted)) {
                const int64_t ahead = (int64_t)(frame->tick - wanted->tick);
                *offset = bridge ? -ahead : ahead;
                return true;
            }
        }
    }
    return false;
}

static bool pair_full(const struct whisker_pair *pair, int bridge)
{
    return pair->count[bridge] == WHISKER_PAIR_HELD;
}

/* One is full, and of the other no more will be held. */
static bool pair_exhausted(const struct whisker_pair *pair)
{
    return pair->count[0] + pair->count[1] >= 2 * WHISKER_PAIR_HELD - 1;
}

static bool pair_slipped(struct whisker_pair *pair)
{
    return pair_tick_of(pair, 0, 0) == pair_tick_of(pair, 1, 0) &&
           pair_is_apart(pair_held(pair, 0, 0), pair_held(pair, 1, 0)) && !pair->blind;
}

/* Both bridges have frames. False: which of them belong together is not known before more have come. *early: the
 * second's oldest is of before the first's tick 0. */
static bool pair_align(struct whisker_pair *pair, bool *early)
{
    int64_t offset;
    if (!pair->searching && !pair_slipped(pair)) {
        return true;
    }
    pair->searching = true;
    if (pair_find_offset(pair, &offset)) {
        *early = (int64_t)pair_held(pair, 1, 0)->tick + offset < 0;
        if (*early) {
            return false;
        }
        pair->counts.realigned += offset != pair->offset;
        pair->offset = offset;
        pair->searching = false;
    } else if (!pair_usb_time_known(pair_held(pair, 0, 0), pair_held(pair, 1, 0))) {
        pair->searching = false;
    } else if (pair_exhausted(pair)) {
        pair->blind = true;
        pair->searching = false;
    }
    return !pair->searching;
}

static bool pair_awaited(const struct whisker_pair *pair, int bridge)
{
    return pair->running[bridge] && !pair->silent[bridge];
}

/* The bridge whose oldest frame waits for nothing any more; -1: neither's does. */
static int pair_lonely(struct whisker_pair *pair, bool aligned)
{
    if (pair->count[0] > 0 && pair->count[1] > 0 && (aligned || !pair->running[0] || !pair->running[1])) {
        return pair_tick_of(pair, 1, 0) < pair_tick_of(pair, 0, 0);
    }
    for (int bridge = 0; bridge < 2; bridge++) {
        pair->silent[!bridge] |= pair_full(pair, bridge) && pair->count[!bridge] == 0;
        const bool waits = pair->running[bridge] && pair_awaited(pair, !bridge);
        if (pair_full(pair, bridge) || (pair->count[bridge] > 0 && !waits)) {
            return bridge;
        }
    }
    return -1;
}

int whisker_pair_next(struct whisker_pair *pair, struct whisker_frame frames[2])
{
    bool early = false;
    const bool aligned = pair->count[0] > 0 && pair->count[1] > 0 && pair_align(pair, &early);
    if (aligned && pair_tick_of(pair, 0, 0) == pair_tick_of(pair, 1, 0)) {
        pair_take(pair, 0, &frames[0]);
        pair_take(pair, 1, &frames[1]);
        pair->counts.paired++;
        pair->counts.apart += pair_is_apart(&frames[0], &frames[1]);
        return 2;
    }
    const int bridge = early ? 1 : pair_lonely(pair, aligned);
    if (bridge < 0) {
        return 0;
    }
    pair_take(pair, bridge, &frames[0]);
    pair->counts.alone[bridge]++;
    return 1;
}
