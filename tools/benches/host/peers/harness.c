#define _GNU_SOURCE
#include "harness.h"

#include <fcntl.h>
#include <sched.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <time.h>
#include <unistd.h>

#define TICK_NS 500000
#define CHECK_EVERY 32    /* frames between two looks at the readers' progress */
#define LOST_NS 200000000 /* no progress for so long: what is missing does not come any more */
#define SAMPLES_MAX 4000000
#define READERS_MAX 64

/* Shared by all processes of a run; each reader writes a cache line of its own. */
struct control {
    _Atomic uint64_t ready, go, done, sent;
    struct {
        _Alignas(64) _Atomic uint64_t through; /* index after the last frame received */
    } reader[READERS_MAX];
};

struct bench {
    struct control *control;
    const char *out;
    bool publishes, waits, paced, free_running;
    uint32_t readers, index;
    int64_t length_ns, began, ended, next_tick, last_seen, handed_over;
    uint64_t sent, behind, received, lost, bad;
    uint32_t *times; /* a subscriber's latencies; a publisher's time per publication, at 2 kHz */
    size_t samples;
};

static int64_t now_ns(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000000000 + now.tv_nsec;
}

static struct control *map_control(const char *path)
{
    const int fd = open(path, O_RDWR | O_CLOEXEC);
    if (fd < 0) {
        return NULL;
    }
    void *memory = mmap(NULL, sizeof(struct control), PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
    close(fd);
    return memory == MAP_FAILED ? NULL : memory;
}

struct bench *bench_open(int argc, char **argv)
{
    struct bench *bench = calloc(1, sizeof *bench);
    if (!bench || argc != 9 || !(bench->control = map_control(argv[2]))) {
        fprintf(stderr, "usage: publish|subscribe CONTROL poll|wait 2khz|flat|free SECONDS READERS INDEX OUT\n");
        free(bench);
        return NULL;
    }
    bench->publishes = strcmp(argv[1], "publish") == 0;
    bench->waits = strcmp(argv[3], "wait") == 0;
    bench->paced = strcmp(argv[4], "2khz") == 0;
    bench->free_running = strcmp(argv[4], "free") == 0;
    bench->length_ns = (int64_t)(atof(argv[5]) * 1e9);
    bench->readers = (uint32_t)atoi(argv[6]);
    bench->index = (uint32_t)atoi(argv[7]);
    bench->out = argv[8];
    bench->times = malloc(SAMPLES_MAX * sizeof *bench->times);
    if (bench->times) {
        memset(bench->times, 0, SAMPLES_MAX * sizeof *bench->times); /* no page faults later */
    }
    return bench;
}

bool bench_publishes(const struct bench *bench)
{
    return bench->publishes;
}

bool bench_waits(const struct bench *bench)
{
    return bench->waits;
}

uint32_t bench_readers(const struct bench *bench)
{
    return bench->readers;
}

uint32_t bench_index(const struct bench *bench)
{
    return bench->index;
}

void bench_start(struct bench *bench)
{
    while (atomic_load(&bench->control->ready) < bench->readers) {
        nanosleep(&(struct timespec){.tv_nsec = 1000000}, NULL);
    }
    nanosleep(&(struct timespec){.tv_nsec = 300000000}, NULL); /* discovery settles */
    bench->began = bench->next_tick = now_ns();
    atomic_store(&bench->control->go, 1);
}

static uint64_t slowest(const struct bench *bench)
{
    uint64_t least = UINT64_MAX;
    for (uint32_t i = 0; i < bench->readers; i++) {
        const uint64_t through = atomic_load_explicit(&bench->control->reader[i].through, memory_order_relaxed);
        least = through < least ? through : least;
    }
    return least;
}

/* Flat out, but nobody is left behind: the same credit for every transport, whatever it does against loss itself. */
static void wait_for_slowest(struct bench *bench)
{
    const int64_t since = now_ns();
    while (bench->sent - slowest(bench) > BENCH_WINDOW && bench->sent > slowest(bench)) {
        sched_yield();
        if (now_ns() - since > LOST_NS) {
            bench->behind++;
            return;
        }
    }
}

static void record(struct bench *bench, int64_t nanoseconds)
{
    if (bench->samples < SAMPLES_MAX) {
        bench->times[bench->samples++] = (uint32_t)nanoseconds;
    }
}

bool bench_next(struct bench *bench, uint8_t frame[BENCH_FRAME_BYTES])
{
    if (bench->paced) {
        if (bench->sent > 0) {
            record(bench, now_ns() - bench->handed_over);
        }
        bench->next_tick += TICK_NS;
        const struct timespec at = {.tv_sec = bench->next_tick / 1000000000, .tv_nsec = bench->next_tick % 1000000000};
        clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &at, NULL);
    } else if (!bench->free_running && bench->sent % CHECK_EVERY == 0) {
        wait_for_slowest(bench);
    }
    const int64_t now = now_ns();
    if (now - bench->began > bench->length_ns) {
        bench->ended = now;
        return false;
    }
    memcpy(frame, &bench->sent, 8);
    memcpy(frame + 8, &now, 8);
    memcpy(frame + BENCH_FRAME_BYTES - 8, &bench->sent, 8);
    bench->sent++;
    bench->handed_over = now;
    return true;
}

static int by_size(const void *a, const void *b)
{
    const uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
    return (x > y) - (x < y);
}

/* Of the times recorded; 0 if there are none. */
static uint32_t median(struct bench *bench)
{
    qsort(bench->times, bench->samples, sizeof *bench->times, by_size);
    return bench->samples > 0 ? bench->times[bench->samples / 2] : 0;
}

int bench_finish(struct bench *bench)
{
    atomic_store(&bench->control->sent, bench->sent);
    atomic_store(&bench->control->done, 1);
    printf("{\"sent\": %llu, \"seconds\": %.6f, \"gave_up_waiting\": %llu, \"publish_ns\": %u}\n",
           (unsigned long long)bench->sent, (double)(bench->ended - bench->began) * 1e-9,
           (unsigned long long)bench->behind, median(bench));
    fflush(stdout);
    nanosleep(&(struct timespec){.tv_sec = 1}, NULL); /* what is under way still arrives */
    return 0;
}

void bench_ready(struct bench *bench)
{
    bench->last_seen = now_ns();
    atomic_fetch_add(&bench->control->ready, 1);
}

void bench_take(struct bench *bench, const uint8_t *frame)
{
    uint64_t index, again;
    int64_t sent_at;
    memcpy(&index, frame, 8);
    memcpy(&sent_at, frame + 8, 8);
    memcpy(&again, frame + BENCH_FRAME_BYTES - 8, 8);
    const int64_t now = now_ns();
    const uint64_t expected = bench->received + bench->lost;
    if (index != again || index < expected) {
        bench->bad++;
        return;
    }
    bench->lost += index - expected;
    bench->received++;
    bench->last_seen = now;
    record(bench, now - sent_at);
    atomic_store_explicit(&bench->control->reader[bench->index].through, index + 1, memory_order_relaxed);
}

struct bench_mark bench_mark(const struct bench *bench)
{
    return (struct bench_mark){bench->received, bench->lost, bench->bad, bench->samples};
}

void bench_take_back(struct bench *bench, struct bench_mark mark)
{
    bench->received = mark.received;
    bench->lost = mark.lost;
    bench->bad = mark.bad;
    bench->samples = mark.samples;
}

bool bench_over(struct bench *bench)
{
    if (!bench->waits) {
        sched_yield();
    }
    return atomic_load_explicit(&bench->control->done, memory_order_acquire) &&
           (bench->received + bench->lost >= atomic_load(&bench->control->sent) ||
            now_ns() - bench->last_seen > 2 * LOST_NS);
}

int bench_report(struct bench *bench)
{
    FILE *file = fopen(bench->out, "wb");
    if (!file || fwrite(bench->times, sizeof *bench->times, bench->samples, file) != bench->samples ||
        fclose(file) != 0) {
        fprintf(stderr, "%s: cannot be written\n", bench->out);
        return 1;
    }
    const uint64_t sent = atomic_load(&bench->control->sent), seen = bench->received + bench->lost;
    printf("{\"received\": %llu, \"lost\": %llu, \"bad\": %llu}\n", (unsigned long long)bench->received,
           (unsigned long long)(bench->lost + (sent > seen ? sent - seen : 0)), (unsigned long long)bench->bad);
    return 0;
}
