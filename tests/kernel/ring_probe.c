/* A reader of whiskerd's ring for the guest: so many frames, each in its place, no record of a lane in use bad but
 * those of nodes that start. usage: ring_probe RING FRAMES [CUTS [FILE]]. CUTS: how often the bridge goes and comes
 * back meanwhile (0). FILE: gets each frame's tick, in 8 bytes, and its lanes as they lie in the ring. Says how far it
 * is after every thousand. */
#include <inttypes.h>
#include <string.h>

#include "probe.h"
#include "whisker/whisker.h"

enum { WAIT_MS = 120000, PROGRESS_FRAMES = 1000, BATCH = 256 };

static uint64_t frames, bad_records, cuts;
static uint32_t sequence;
static uint64_t tick;
static FILE *kept;

static void count_bad_records(const struct whisker_frame *frame)
{
    for (size_t lane = 0; lane < WHISKER_FRAME_LANES; lane++) {
        const unsigned code = frame->lane[lane].status >> WHISKER_STATUS_CODE_SHIFT;
        const bool used = frame->lane_mask >> lane & 1u;
        bad_records += used && frame->lane[lane].status != 0 && code != WHISKER_CODE_STARTING;
    }
}

static void check_frame(const struct whisker_frame *frame)
{
    const bool begins = frames == 0 || (frame->flags & WHISKER_FRAME_GAP) != 0;
    cuts += begins && frames > 0;
    if (!begins && (frame->sequence != sequence + 1 || frame->tick != tick + 1)) {
        fail("sequence %" PRIu32 ", tick %" PRIu64 " follow %" PRIu32 ", %" PRIu64, frame->sequence, frame->tick,
             sequence, tick);
    }
    if (frame->dropped != 0) {
        fail("the bridge dropped %" PRIu32 " frames", frame->dropped);
    }
    sequence = frame->sequence;
    tick = frame->tick;
    count_bad_records(frame);
    if (kept && (fwrite(&tick, sizeof tick, 1, kept) != 1 || fwrite(frame->lane, sizeof frame->lane, 1, kept) != 1)) {
        fail("frames cannot be kept");
    }
    if (++frames % PROGRESS_FRAMES == 0) {
        printf("%" PRIu64 "\n", frames);
        fflush(stdout);
    }
}

/* Copies before it looks, so that only what is known to be whole is judged. */
static void take_batch(struct whisker_reader *reader)
{
    static struct whisker_frame batch[BATCH];
    const struct whisker_frame *there;
    size_t count;
    int error = whisker_reader_peek(reader, &there, &count);
    if (!error) {
        count = count < BATCH ? count : BATCH;
        memcpy(batch, there, count * sizeof *there);
        error = whisker_reader_advance(reader, count);
    }
    if (error) {
        fail("ring: %s", whisker_error_text(error));
    }
    for (size_t i = 0; i < count; i++) {
        check_frame(&batch[i]);
    }
}

int main(int argc, char **argv)
{
    struct whisker_reader *reader = NULL;
    const uint64_t wanted = argc >= 3 ? strtoull(argv[2], NULL, 10) : 0;
    const uint64_t cuts_due = argc >= 4 ? strtoull(argv[3], NULL, 10) : 0;
    if (wanted == 0) {
        fail("usage: ring_probe RING FRAMES [CUTS [FILE]]");
    }
    if (argc == 5 && !(kept = fopen(argv[4], "wb"))) {
        fail("%s cannot be written", argv[4]);
    }
    int error = whisker_reader_attach(argv[1], WAIT_MS, &reader);
    while (!error && frames < wanted) {
        error = whisker_reader_wait(reader, WAIT_MS);
        if (!error) {
            take_batch(reader);
        }
    }
    if (error) {
        fail("%s after %" PRIu64 " frames", whisker_error_text(error), frames);
    }
    whisker_reader_detach(reader);
    if (kept && fclose(kept) != 0) {
        fail("frames cannot be kept");
    }
    if (cuts != cuts_due) {
        fail("the bridge came back %" PRIu64 " times, not %" PRIu64, cuts, cuts_due);
    }
    if (bad_records > 0) {
        fail("%" PRIu64 " frames, but %" PRIu64 " bad records", frames, bad_records);
    }
    printf("%" PRIu64 " frames, ticks to %" PRIu64 "\n", frames, tick);
    return EXIT_SUCCESS;
}
