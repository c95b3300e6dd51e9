/* Power cuts during an update: at each step by name, or at any time. */
#ifndef UPDATE_CUTS_H
#define UPDATE_CUTS_H

#include "update_bench.h"

/* What may run once the supply is back. */
enum update_fate { FATE_OLD = 1, FATE_LOADER = 2, FATE_NEW = 4 };

struct update_cut_case {
    const char *name;
    struct update_cut cut;
    unsigned fates; /* allowed ones */
    const char *remark;
};

extern const struct update_cut_case UPDATE_CUT_CASES[];
extern const unsigned UPDATE_CUT_CASE_COUNT;

struct update_cut_outcome {
    enum update_fate fate;
    bool reported;  /* the first record after the cut is one that nobody drives */
    unsigned ticks; /* from the supply's return to the first record that is good, or says that the loader runs */
    bool again;     /* a second update then succeeded, and its image gave good records */
};

/* At most: PLL 1.1 ms, the image compared, sensor and its wait 18.4 ms (2 % slow), then a reading and its transfer. */
#ifndef UPDATE_CUT_TICKS
#define UPDATE_CUT_TICKS 43u
#endif

/* Cuts the supply of node `seed` where `cut` says, or so long after the update began if that is not due. */
struct update_cut_outcome update_cut_run(struct update_cut cut, uint64_t after_ns, uint64_t seed);

#endif
