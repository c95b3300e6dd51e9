#include "update_cuts.h"

#include <string.h>

/* Dark for longer than an erasure, which the chip's model ends in one piece before it takes notice of the cut. */
enum { SERIAL = 77, DARK_TICKS = 60, LONGEST = 200 };

/* An order is taken up 290 us after its tick's SYNC. A row's write takes 1.6 ms, a page's erasure 24. */
#define AT(order, us)                                                                                                  \
    {                                                                                                                  \
        .due = true, .command = WHISKER_SERVICE_COMMAND_##order, .after_ns = (us)*1000u                                \
    }
#define AT_BLOCK(number, us)                                                                                           \
    {                                                                                                                  \
        .due = true, .command = WHISKER_SERVICE_COMMAND_BLOCK, .block = (number), .after_ns = (us)*1000u               \
    }

/* Where the processor's own time counts, the image is still being compared then. */
#ifdef UPDATE_CHECK_TAKES_TIME
#define AFTER_CHECK FATE_LOADER
#else
#define AFTER_CHECK FATE_NEW
#endif

const struct update_cut_case UPDATE_CUT_CASES[] = {
    {"order to enter the loader under way", AT(ENTER, 150), FATE_OLD, "nothing is erased yet"},
    {"leaving for the loader", AT(ENTER, 800), FATE_OLD, NULL},
    {"image's header under way", AT(BEGIN, 150), FATE_OLD, NULL},
    {"erasing begins", AT(BEGIN, 330), FATE_OLD | FATE_LOADER, "the header is gone or it is not"},
    {"erasing the header's page", AT(BEGIN, 12300), FATE_LOADER, NULL},
    {"first block under way", AT_BLOCK(0, 150), FATE_LOADER, NULL},
    {"block amid a row", AT_BLOCK(2, 400), FATE_LOADER, NULL},
    {"writing a row", AT_BLOCK(3, 1000), FATE_LOADER, NULL},
    {"erasing a later page", AT_BLOCK(31, 12300), FATE_LOADER, NULL},
    {"writing a page's first row", AT_BLOCK(31, 25000), FATE_LOADER, NULL},
    {"writing the last row", AT_BLOCK(UPDATE_BLOCKS - 1, 1000), FATE_LOADER, NULL},
    {"comparing the image", AT(FINISH, 300), FATE_LOADER, NULL},
    {"writing the header begins", AT(FINISH, 330), FATE_LOADER, NULL},
    {"writing the header", AT(FINISH, 500), FATE_LOADER, NULL},
    {"header written, its row's padding under way", AT(FINISH, 1100), AFTER_CHECK, NULL},
    {"its row written", AT(FINISH, 3000), AFTER_CHECK, NULL},
    {"order to run under way", AT(RUN, 150), FATE_NEW, NULL},
    {"leaving for the application", AT(RUN, 800), FATE_NEW, NULL},
    {"sensor starting after the update", AT(RUN, 9000), FATE_NEW, NULL},
};
const unsigned UPDATE_CUT_CASE_COUNT = sizeof UPDATE_CUT_CASES / sizeof *UPDATE_CUT_CASES;

static bool update_cuts_is_absent(const struct update_bench *b)
{
    uint8_t common = 0xFFu;
    for (unsigned i = 0; i < WHISKER_RECORD_BYTES; i++)
        common &= b->record[i];
    return common == 0xFFu;
}

static bool update_cuts_speaks(const struct update_bench *b)
{
    const int code = update_code(b);
    return code == (int)WHISKER_CODE_OK || code == (int)WHISKER_CODE_LOADER;
}

static unsigned update_cuts_ticks_until_it_speaks(struct update_bench *b)
{
    unsigned ticks = 0;
    do {
        update_ticks(b, 1);
        ticks++;
    } while (!update_cuts_speaks(b) && ticks < LONGEST);
    return ticks;
}

static enum update_fate update_cuts_fate_of(const struct update_bench *b)
{
    switch (sim_node_version(b->node)) {
    case 0:
        return FATE_LOADER;
    case SIM_NODE_VERSION:
        return FATE_OLD;
    default:
        return sim_node_version(b->node) == UPDATE_VERSION ? FATE_NEW : 0;
    }
}

/* The code fits what runs, five times in a row. */
static bool update_cuts_is_steady(struct update_bench *b)
{
    const int wanted = sim_node_version(b->node) == 0 ? (int)WHISKER_CODE_LOADER : (int)WHISKER_CODE_OK;
    bool yes = true;
    for (int i = 0; i < 5; i++) {
        update_ticks(b, 1);
        yes &= update_code(b) == wanted;
    }
    return yes;
}

static void update_cuts_wait_for_the_cut(struct update_bench *b)
{
    for (unsigned i = 0; i < LONGEST && !sim_node_dark(b->node); i++)
        update_ticks(b, 1);
}

struct update_cut_outcome update_cut_run(struct update_cut cut, uint64_t after_ns, uint64_t seed)
{
    struct update_cut_outcome out = {0};
    struct update_bench b;
    const struct update_image image = update_image_of(UPDATE_VERSION);
    if (!update_begin(&b, seed, SERIAL, WHISKER_LIMIT_CHIP_ID))
        return out;
    update_ticks(&b, 1);
    b.cut = cut;
    if (!cut.due)
        sim_node_cut(b.node, after_ns);
    update_run(&b, &image, 0);
    update_cuts_wait_for_the_cut(&b);
    const bool cuts = sim_node_dark(b.node);
    update_ticks(&b, 1);
    out.reported = cuts && update_cuts_is_absent(&b);
    update_ticks(&b, DARK_TICKS - 1);
    sim_node_restore(b.node);
    out.ticks = update_cuts_ticks_until_it_speaks(&b);
    out.fate = update_cuts_is_steady(&b) ? update_cuts_fate_of(&b) : 0;
    out.again = update_run(&b, &image, 0) == (int)WHISKER_NODE_STATE_COMPLETE;
    update_ticks(&b, UPDATE_CUT_TICKS + 10);
    out.again = out.again && update_cuts_is_steady(&b) && update_cuts_fate_of(&b) == FATE_NEW;
    sim_node_free(b.node);
    return out;
}
