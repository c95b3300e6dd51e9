#include "storm_log.h"

#include "node.h" // NODE_ORDER_MOST_US
#include "storm_checks.h"
#include "whisker_protocol.h"

enum { NOW, BEFORE, EARLIER };

/* A SYNC that comes so much before its tick may pass: NODE_ORDER_MOST_US, asked to 4 us, by a node's clock 4 % slow
 * that is read 2 us after the edge, less the 29 us from the tick's SYNC to its order at the storm's link settings. */
#define EARLY_MOST_FS (((NODE_ORDER_MOST_US + 4u) * 26u / 25u + 2u - 29u) * 1000u * DSPIC_FS_PER_NS)

/* After these neither the node's state nor the sensor's is known until a good record. */
static bool storm_log_makes_ill(const struct lane_faults *f)
{
    return f->disturbance != SIM_NODE_NOTHING && f->disturbance != SIM_NODE_UNREAD;
}

static bool storm_log_loses_order(const struct lane_faults *f)
{
    return f->mosi_flips != 0 || f->mosi_stuck || f->no_select || f->extra_clocks < 0 || f->glitch_bit > 0;
}

void storm_log_deed(struct storm_log *log, bool any, enum storm_kind kind, const struct lane_faults *faults)
{
    log->deeds[EARLIER] = log->deeds[BEFORE];
    log->deeds[BEFORE] = log->deeds[NOW];
    log->ill |= storm_log_makes_ill(faults);
    log->deeds[NOW] = (struct storm_deed){
        .any = any,
        .kind = kind,
        .faults = *faults,
        .stray = faults->second_sync_ns > 0 || (log->deeds[BEFORE].stray && storm_log_loses_order(faults)),
        .ill = log->ill,
    };
}

static bool storm_log_breaks_line(const struct storm_deed *deed)
{
    return deed->any && deed->kind <= STORM_EXTRA_CLOCK;
}

/* ------------------------------------------------------------------------------------------------- the sensor's line
 */

static enum storm_line storm_log_line_of(const struct storm_deed *deed, const struct sim_node_frame *frame)
{
    if (deed->ill || (frame->slip != 0 && storm_log_breaks_line(deed)))
        return STORM_LINE_OTHER;
    switch (frame->slip) {
    case 0:
        return storm_log_breaks_line(deed) ? (enum storm_line)deed->kind : STORM_LINE_OTHER;
    case 1:
        return STORM_LINE_AHEAD;
    case 63:
        return STORM_LINE_BEHIND;
    default:
        return STORM_LINE_OTHER;
    }
}

/* Is the line what the log says that this made of it? `last`: the bit before the frame. */
static bool storm_log_is_foreseen(enum storm_line line, const struct lane_faults *faults,
                                  const struct sim_node_frame *frame)
{
    const unsigned argument = faults->sensor_argument;
    const uint64_t sent = frame->sent;
    switch (line) {
    case STORM_LINE_FLIP_BIT:
        return frame->line == (sent ^ checks_mask(argument));
    case STORM_LINE_FLIP_TWO:
        return frame->line == (sent ^ checks_mask(argument & 0xFFu) ^ checks_mask(argument >> 8));
    case STORM_LINE_DEAD:
        return frame->line == ~UINT64_C(0);
    case STORM_LINE_STUCK_LOW:
        return frame->line == 0;
    case STORM_LINE_ERROR_BITS:
        return frame->line == checks_error_word(sent, (uint16_t)argument);
    case STORM_LINE_LOST_CLOCK:
        return frame->line == checks_lost_clock(sent, argument, frame->line >> 63);
    case STORM_LINE_EXTRA_CLOCK:
        return frame->line == checks_extra_clock(sent, argument);
    case STORM_LINE_BEHIND:
        return (frame->line & ~checks_mask(0)) == sent >> 1;
    case STORM_LINE_AHEAD:
        return frame->line == (sent << 1 | 1u);
    default:
        return true;
    }
}

/* That of the tick in which the frame began. */
static const struct storm_deed *storm_log_deed_of(const struct storm_log *log, const struct lane_verdict *v)
{
    const int64_t shift_fs = log->deeds[BEFORE].faults.shift_ns * (int64_t)DSPIC_FS_PER_NS;
    return &log->deeds[(int64_t)v->report.frame.begun_fs < (int64_t)v->sync_fs + shift_fs ? EARLIER : BEFORE];
}

/* A frame that has just ended. True if bits of it were hurt. */
static bool log_frame(struct storm_log *log, const struct lane_verdict *v)
{
    const struct sim_node_frame *frame = &v->report.frame;
    const struct storm_deed *deed = storm_log_deed_of(log, v);
    const bool hurt = frame->line != frame->sent, struck = storm_log_breaks_line(deed) || frame->slip != 0;
    if (!struck && !deed->ill)
        log->counts.unforeseen += hurt;
    if (!struck && !hurt)
        return false;
    log->counts.unforeseen += !storm_log_is_foreseen(storm_log_line_of(deed, frame), &deed->faults, frame);
    return hurt;
}

/* ---------------------------------------------------------------------------------------------------------- the link
 */

static bool storm_log_breaks_link(const struct lane_faults *f)
{
    return f->miso_flips != 0 || f->glitch_bit > 0 || f->extra_clocks < 0 || f->no_select || f->miso_stuck;
}

/* Select may have stayed low since the tick before: then nothing of it is missed. */
static bool storm_log_is_selected(const struct storm_log *log)
{
    return !log->deeds[NOW].faults.no_select || log->deeds[BEFORE].faults.select_stays;
}

/* Words of the link were taken otherwise in the tick before: its order, hurt, passed for one that announces a service
 * order; or its transfer ended early while select hid the end of the transfer before, by which the node notices. */
static bool storm_log_is_misaligned(const struct storm_log *log, uint8_t before)
{
    const struct lane_faults *f = &log->deeds[BEFORE].faults;
    return (f->mosi_flips != 0 && checks_are_service(lane_order(before) ^ f->mosi_flips)) ||
           (f->extra_clocks < 0 && log->deeds[EARLIER].faults.select_stays);
}

static bool storm_log_link_is_foreseen(const struct storm_log *log, const struct lane_verdict *v, uint8_t before)
{
    const struct storm_deed *deed = &log->deeds[NOW];
    const struct lane_faults *f = &deed->faults;
    if (deed->ill || v->rearmed || f->glitch_bit > 0 || storm_log_is_misaligned(log, before))
        return true;
    if (f->miso_stuck)
        return v->read == (f->miso_level ? ~UINT64_C(0) : 0u);
    if (!storm_log_is_selected(log))
        return v->read == ~UINT64_C(0);
    return v->read ==
           (f->extra_clocks < 0 ? checks_cut(v->armed, (unsigned)-f->extra_clocks) : v->armed ^ f->miso_flips);
}

/* ----------------------------------------------------------------------------------------------------- good records */

/* This tick's own SYNC was kept from the node, which took a stray one for it; so little before that its order did not
 * come too long after. */
static bool storm_log_is_displaced(const struct storm_log *log, const struct lane_verdict *v)
{
    const struct sim_node_frame *frame = &v->report.frame;
    return log->deeds[BEFORE].faults.no_sync && log->deeds[EARLIER].stray &&
           frame->begun_fs + EARLY_MOST_FS > v->sync_fs && frame->line == frame->sent &&
           checks_are_angles(frame->sent, v->alpha, v->beta);
}

/* A good record whose bits were hurt, or whose angles are not those of its tick: which check let it pass, and had to?
 */
static void storm_log_explain(struct storm_log *log, const struct lane_verdict *v, bool line_hurt, uint8_t expected)
{
    const struct sim_node_frame *frame = &v->report.frame;
    const bool link_hurt = v->read != v->armed;
    if (link_hurt && (storm_log_breaks_link(&log->deeds[NOW].faults) || v->rearmed || log->ill) &&
        checks_pass_record(v->read, expected))
        log->counts.missed_link++;
    else if (!link_hurt && line_hurt && checks_pass_line(frame->line) && checks_pass_step(frame, frame->line) &&
             checks_are_angles(frame->line, v->alpha, v->beta))
        log->counts.missed_line++;
    else if (!link_hurt && !line_hurt && storm_log_is_displaced(log, v))
        log->counts.displaced++;
    else
        log->counts.unexplained++;
}

/* Arming displaces words only amid a transfer. A node that starts amid one arms words of which that transfer takes a
 * part, and the next one displaces what is left. */
static void log_overwritten(struct storm_log *log, const struct lane_verdict *v)
{
    const uint32_t words = v->report.overwritten - log->overwritten;
    log->overwritten = v->report.overwritten;
    if (log->overlapped)
        log->counts.overwritten += words;
    else
        log->counts.violations += words;
    log->overlapped = (log->overlapped << 1 | v->overlapped) & 3u;
}

/* What struck may not yet show. */
static bool storm_log_is_struck(const struct storm_log *log)
{
    return storm_log_makes_ill(&log->deeds[NOW].faults) || storm_log_makes_ill(&log->deeds[BEFORE].faults) ||
           storm_log_makes_ill(&log->deeds[EARLIER].faults);
}

bool storm_log_verdict(struct storm_log *log, unsigned tick, const struct lane_verdict *v)
{
    const uint8_t expected = (uint8_t)(tick - 1u);
    const bool is_new = v->report.frame.number != log->frame;
    const bool line_hurt = is_new && log_frame(log, v);
    log->frame = v->report.frame.number;
    log->counts.unforeseen += !storm_log_link_is_foreseen(log, v, expected);
    log_overwritten(log, v);
    log->counts.ticks++;
    log->counts.bad += !v->good;
    const bool sound = v->good && !v->altered && !line_hurt && v->read == v->armed;
    if (v->good && !sound)
        storm_log_explain(log, v, line_hurt, expected);
    log->ill &= !sound || storm_log_is_struck(log);
    return sound;
}
