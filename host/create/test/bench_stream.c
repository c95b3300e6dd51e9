/* Prints what a byte of the stream costs the parser: `bench_stream [frames]`, one line per stream. */
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "create/stream.h"
#include "stream_bytes.h"

static const uint8_t ids[] = {7, 9, 10, 11, 12, 19, 20, 22, 25, 26, 34, 35, 41, 42};

static double now_ns(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec * 1e9 + (double)now.tv_nsec;
}

/* Feeds one frame over and over; every `each` bytes one is spoiled (0: none). */
static void run(const char *name, long frames, long each)
{
    static struct create_stream stream;
    struct create_frame frame;
    uint8_t bytes[CREATE_STREAM_BYTES];
    const int32_t value[CREATE_OI_PACKET_MAX + 1] = {[19] = 19, [20] = 19, [22] = 14500};
    const size_t length = stream_bytes(bytes, ids, sizeof ids, value);
    long until = each;
    create_stream_begin(&stream, ids, sizeof ids);
    const double begin = now_ns();
    for (long i = 0; i < frames; i++) {
        for (size_t k = 0; k < length; k++) {
            const bool spoil = each > 0 && --until == 0;
            until = spoil ? each : until;
            create_stream_push(&stream, (uint8_t)(bytes[k] ^ spoil), &frame);
        }
    }
    const double spent = now_ns() - begin;
    printf("%s: %.1f ns/byte, %llu of %ld frames\n", name, spent / (double)stream.counts.bytes,
           (unsigned long long)stream.counts.frames, frames);
}

int main(int argc, char **argv)
{
    const long frames = argc > 1 ? atol(argv[1]) : 100000;
    run("good", frames, 0);
    run("one byte in 101 spoiled", frames, 101);
    return 0;
}
