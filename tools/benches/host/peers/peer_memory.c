/*
 * The lower bound, not a transport: 256 bytes of shared memory and their index, stored last. It holds one frame, does
 * not detect a loss and wakes no reader. It measures the way of five cache lines from one processor to another, and the
 * harness itself.
 */
#define _GNU_SOURCE
#include <fcntl.h>
#include <stdatomic.h>
#include <stdio.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#include "harness.h"

#define NAME "/whisker-bench-memory"

struct slot {
    _Alignas(64) _Atomic uint64_t published; /* frames */
    _Alignas(64) uint8_t frame[BENCH_FRAME_BYTES];
};

static struct slot *map_slot(int flags)
{
    const int fd = shm_open(NAME, flags, 0600);
    if (fd < 0 || ftruncate(fd, sizeof(struct slot)) != 0) {
        return NULL;
    }
    void *memory = mmap(NULL, sizeof(struct slot), PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
    close(fd);
    return memory == MAP_FAILED ? NULL : memory;
}

static int publish(struct bench *bench)
{
    struct slot *slot = map_slot(O_CREAT | O_TRUNC | O_RDWR);
    uint8_t frame[BENCH_FRAME_BYTES] = {0};
    if (!slot) {
        fprintf(stderr, "peer_memory: no shared memory\n");
        return 1;
    }
    bench_start(bench);
    for (uint64_t published = 1; bench_next(bench, frame); published++) {
        memcpy(slot->frame, frame, sizeof frame);
        atomic_store_explicit(&slot->published, published, memory_order_release);
    }
    const int code = bench_finish(bench);
    shm_unlink(NAME);
    return code;
}

static int subscribe(struct bench *bench)
{
    struct slot *slot = map_slot(O_RDWR);
    if (!slot) {
        fprintf(stderr, "peer_memory: start the publisher first\n");
        return 1;
    }
    bench_ready(bench);
    for (uint64_t taken = 0;;) {
        const uint64_t published = atomic_load_explicit(&slot->published, memory_order_acquire);
        if (published != taken) {
            bench_take(bench, slot->frame);
            taken = published;
        } else if (bench_over(bench)) {
            return bench_report(bench);
        }
    }
}

int main(int argc, char **argv)
{
    struct bench *bench = bench_open(argc, argv);
    return !bench ? 2 : bench_publishes(bench) ? publish(bench) : subscribe(bench);
}
