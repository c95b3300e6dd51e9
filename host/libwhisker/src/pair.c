#include "whisker/pair.h"

#include <string.h>

#include "whisker/errors.h"

#define USB_TIME_KNOWN 0x8000u
#define MICROFRAMES 0x4000u /* after so many they count anew */

void whisker_pair_init(struct whisker_pair *pair)
{
    memset(pair, 0, sizeof *pair);
}

int whisker_pair_add(struct whisker_pair *pair, int bridge, const struct whisker_frame *frame)
{
    if (bridge < 0 || bridge > 1 || pair->count[bridge] == WHISKER_PAIR_HELD) {
        return WHISKER_ERROR_ARGUMENT;
    }
    pair->held[bridge][(pair->first[bridge] + pair->count[bridge]) % WHISKER_PAIR_HELD] = *frame;
    pair->count[bridge]++;
    return WHISKER_OK;
}

static const struct whisker_frame *oldest(const struct whisker_pair *pair, int bridge)
{
    return &pair->held[bridge][pair->first[bridge]];
}

static void take(struct whisker_pair *pair, int bridge, struct whisker_frame *frame)
{
    *frame = *oldest(pair, bridge);
    frame->sequence = (uint32_t)(2 * frame->tick) + (uint32_t)bridge;
    frame->flags |= bridge ? WHISKER_FRAME_SECOND : 0;
    pair->first[bridge] = (pair->first[bridge] + 1) % WHISKER_PAIR_HELD;
    pair->count[bridge]--;
}

static bool is_apart(const struct whisker_frame *a, const struct whisker_frame *b)
{
    const unsigned at = a->flags >> WHISKER_FRAME_USB_TIME_SHIFT, other = b->flags >> WHISKER_FRAME_USB_TIME_SHIFT;
    const unsigned later = (at - other) % MICROFRAMES;
    return (at & other & USB_TIME_KNOWN) && later > 1 && later < MICROFRAMES - 1;
}

/* The bridge whose oldest frame waits for nothing any more; -1: neither's does. */
static int lonely(const struct whisker_pair *pair)
{
    if (pair->count[0] > 0 && pair->count[1] > 0) {
        return oldest(pair, 1)->tick < oldest(pair, 0)->tick;
    }
    for (int bridge = 0; bridge < 2; bridge++) {
        if (pair->count[bridge] == WHISKER_PAIR_HELD || (pair->ending && pair->count[bridge] > 0)) {
            return bridge;
        }
    }
    return -1;
}

int whisker_pair_next(struct whisker_pair *pair, struct whisker_frame frames[2])
{
    if (pair->count[0] > 0 && pair->count[1] > 0 && oldest(pair, 0)->tick == oldest(pair, 1)->tick) {
        take(pair, 0, &frames[0]);
        take(pair, 1, &frames[1]);
        pair->counts.paired++;
        pair->counts.apart += is_apart(&frames[0], &frames[1]);
        return 2;
    }
    const int bridge = lonely(pair);
    if (bridge < 0) {
        return 0;
    }
    take(pair, bridge, &frames[0]);
    pair->counts.alone[bridge]++;
    return 1;
}

void whisker_pair_end(struct whisker_pair *pair)
{
    pair->ending = true;
}
