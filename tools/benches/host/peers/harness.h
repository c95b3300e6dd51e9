/*
 * One way to measure every transport: the same frames, pace, pinning, clock and judgement. A transport's program is a
 * publisher or a subscriber and only says how it sends, receives and waits.
 *
 * Arguments: publish|subscribe CONTROL poll|wait 2khz|flat|free SECONDS READERS INDEX OUT
 * CONTROL: a file of zeros that all processes map; OUT: where a subscriber's latencies go (uint32, nanoseconds).
 */
#ifndef RING_PEERS_HARNESS_H
#define RING_PEERS_HARNESS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define BENCH_FRAME_BYTES 256
#define BENCH_WINDOW 256 /* flat: how many frames the slowest reader may be behind */

struct bench;

/* Reads the arguments; NULL, with a line on standard error, when they are wrong. */
struct bench *bench_open(int argc, char **argv);

bool bench_publishes(const struct bench *bench);
bool bench_waits(const struct bench *bench); /* else it polls, giving the processor away between looks */
uint32_t bench_readers(const struct bench *bench);
uint32_t bench_index(const struct bench *bench); /* of this subscriber */

/* Publisher: waits until all subscribers are ready. */
void bench_start(struct bench *bench);
/* Publisher: the next frame, at its time. False: the time is over. */
bool bench_next(struct bench *bench, uint8_t frame[BENCH_FRAME_BYTES]);
/* Publisher: ends the run and prints what was sent. Returns the exit code. */
int bench_finish(struct bench *bench);

/* Subscriber: it is attached and will miss nothing. */
void bench_ready(struct bench *bench);
/* Subscriber: a frame has come. */
void bench_take(struct bench *bench, const uint8_t *frame);
/* Subscriber: what was taken since the mark is taken back: the transport says that it may have been overwritten
 * meanwhile. */
struct bench_mark {
    uint64_t received, lost, bad;
    size_t samples;
};
struct bench_mark bench_mark(const struct bench *bench);
void bench_take_back(struct bench *bench, struct bench_mark mark);
/* Subscriber: whether all is over: ask when nothing has come. Gives the processor away if this subscriber polls. */
bool bench_over(struct bench *bench);
/* Subscriber: writes the latencies and prints what was received. Returns the exit code. */
int bench_report(struct bench *bench);

#endif
