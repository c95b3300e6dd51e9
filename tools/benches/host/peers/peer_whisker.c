/* The ring of libwhisker. */
#include <stdio.h>

#include "harness.h"
#include "whisker/errors.h"
#include "whisker/ring.h"

#define NAME "whisker-bench"

static int publish(struct bench *bench)
{
    struct whisker_ring *ring;
    struct whisker_frame frame = {0};
    const int error = whisker_ring_create(NAME, WHISKER_RING_FRAMES, &ring);
    if (error) {
        fprintf(stderr, "peer_whisker: %s\n", whisker_error_text(error));
        return 1;
    }
    bench_start(bench);
    while (bench_next(bench, (uint8_t *)&frame)) {
        whisker_ring_publish(ring, &frame, 1);
    }
    const int code = bench_finish(bench);
    whisker_ring_close(ring);
    return code;
}

static int subscribe(struct bench *bench)
{
    struct whisker_reader *reader;
    const int error = whisker_reader_attach(NAME, 10000, &reader);
    if (error) {
        fprintf(stderr, "peer_whisker: %s\n", whisker_error_text(error));
        return 1;
    }
    bench_ready(bench);
    for (;;) {
        const struct whisker_frame *frames;
        size_t count;
        if (bench_waits(bench)) {
            whisker_reader_wait(reader, 100);
        }
        const struct bench_mark mark = bench_mark(bench);
        whisker_reader_peek(reader, &frames, &count);
        for (size_t i = 0; i < count; i++) {
            bench_take(bench, (const uint8_t *)&frames[i]);
        }
        if (whisker_reader_advance(reader, count) == WHISKER_ERROR_OVERRUN) {
            bench_take_back(bench, mark);
        }
        if (count == 0 && bench_over(bench)) {
            break;
        }
    }
    whisker_reader_detach(reader);
    return bench_report(bench);
}

int main(int argc, char **argv)
{
    struct bench *bench = bench_open(argc, argv);
    return !bench ? 2 : bench_publishes(bench) ? publish(bench) : subscribe(bench);
}
