/*
 * Reads the ring that whiskerd fills and prints lane 0 ten times a second.
 *     cc read_ring.c $(pkg-config --cflags --libs whisker) -o read_ring && ./read_ring whisker
 */
#include <inttypes.h>
#include <stdio.h>
#include <whisker/whisker.h>

#define EVERY 200 /* frames: 0.1 s at 2 kHz */

static int read_ring_fail(const char *what, int error)
{
    fprintf(stderr, "read_ring: %s: %s; %s\n", what, whisker_error_text(error), whisker_error_remedy(error));
    return 1;
}

/* A frame lies in shared memory: look at it, keep no pointer to it. */
static void read_ring_show(const struct whisker_reader *reader, const struct whisker_frame *frame)
{
    const struct whisker_sample *sample = &frame->lane[0];
    struct whisker_clock clock;
    if (frame->tick % EVERY != 0 || whisker_reader_clock(reader, &clock) != 0) {
        return;
    }
    if (sample->status != 0) {
        printf("tick %" PRIu64 ": no good reading, status 0x%04x\n", frame->tick, sample->status);
        return;
    }
    printf("tick %" PRIu64 " at %.4f s: alpha %+.2f deg, beta %+.2f deg\n", frame->tick,
           (double)whisker_clock_to_realtime(&clock, frame->time_cycles) * 1e-9,
           (sample->alpha - 0x8000) * 180.0 / 65536, (sample->beta - 0x8000) * 180.0 / 65536);
}

/* Takes what is there. Counts only once advance has confirmed that the writer did not overtake us meanwhile. */
static int read_ring_take(struct whisker_reader *reader)
{
    const struct whisker_frame *frames;
    size_t count;
    int error = whisker_reader_peek(reader, &frames, &count);
    for (size_t i = 0; !error && i < count; i++) {
        read_ring_show(reader, &frames[i]);
    }
    return error ? error : whisker_reader_advance(reader, count);
}

int main(int argc, char **argv)
{
    const char *name = argc > 1 ? argv[1] : "whisker";
    struct whisker_reader *reader;
    int error = whisker_reader_attach(name, 5000, &reader);
    if (error) {
        return read_ring_fail(name, error);
    }
    while (error == WHISKER_OK) {
        error = whisker_reader_wait(reader, -1);
        if (error == WHISKER_OK) {
            error = read_ring_take(reader);
        }
        if (error == WHISKER_ERROR_OVERRUN) { /* we were too slow; the reader has skipped what is lost */
            fprintf(stderr, "read_ring: frames lost\n");
            error = WHISKER_OK;
        }
        if (error == WHISKER_ERROR_RESTARTED) { /* whiskerd was started again */
            error = whisker_reader_reattach(reader, 5000);
        }
    }
    whisker_reader_detach(reader);
    return error == WHISKER_ERROR_CLOSED ? 0 : read_ring_fail(name, error);
}
