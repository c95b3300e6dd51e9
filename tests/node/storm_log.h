/* What the world broke, bit by bit, held against what the bridge received. */
#ifndef STORM_LOG_H
#define STORM_LOG_H

#include "lane_bench.h"
#include "storm.h"

/* What was done in a tick. */
struct storm_deed {
    bool any;
    enum storm_kind kind;
    struct lane_faults faults;
    bool stray; /* a second SYNC came, or came before and no sound order has put the node's count right since */
    bool ill;   /* chip or sensor without supply, or starting anew: no frame and no transfer of it means anything */
};

/* The fields are the log's own but for `counts`. */
struct storm_log {
    struct storm_counts counts;
    struct storm_deed deeds[3]; /* of the present tick, the one before and the one before that */
    bool ill;
    uint32_t frame;       /* number of the newest frame seen */
    unsigned overlapped;  /* bit 0: the transfer before met the link's arming; bit 1: the one before that */
    uint32_t overwritten; /* words, so far */
};

/* Tick by tick: what is done in it (kind only if `any`), before it happens. */
void storm_log_deed(struct storm_log *log, bool any, enum storm_kind kind, const struct lane_faults *faults);

/* The verdict on the record that the same tick brought, which is the tick before's. True: good, and rightly so. */
bool storm_log_verdict(struct storm_log *log, unsigned tick, const struct lane_verdict *verdict);

#endif
