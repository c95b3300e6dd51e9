/*
 * The ring's readers and writer killed at random instructions, again and again: no frame is ever accepted that is not
 * whole, and the next process goes on at once. Usage: stress_ring [kills] [seed]
 */
#include <signal.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "ring_fixture.h"
#include "whisker/errors.h"

enum { READERS = 4, CAPACITY = 64, PATIENCE_MS = 20000 };

/* What children report, in memory that outlives them. */
struct report {
    atomic_ulong accepted, refused, restarts, torn;
};

static struct report *report;

static uint64_t next_random(uint64_t *state)
{
    *state ^= *state << 13;
    *state ^= *state >> 7;
    *state ^= *state << 17;
    return *state;
}

/* Every field of a frame follows from its tick, so a mixture of two frames is none. */
static uint64_t count_torn(const struct whisker_frame *frames, size_t count)
{
    uint64_t torn = 0;
    for (size_t i = 0; i < count; i++) {
        const uint64_t tick = frames[i].tick;
        torn += !test_frame_is(&frames[i], tick) || (i > 0 && tick != frames[i - 1].tick + 1);
    }
    return torn;
}

static void judge(uint64_t torn, size_t count, int verdict)
{
    if (verdict == WHISKER_OK) {
        atomic_fetch_add(&report->accepted, count);
        atomic_fetch_add(&report->torn, torn);
    } else {
        atomic_fetch_add(&report->refused, count);
    }
}

static void read_some(struct whisker_reader *reader, uint64_t random)
{
    const struct whisker_frame *frames;
    size_t count;
    if (random % 4 == 0) {
        const int given = whisker_reader_window(reader, 1 + random / 4 % CAPACITY, &frames);
        if (given > 0) {
            const uint64_t torn = count_torn(frames, (size_t)given);
            judge(torn, (size_t)given, whisker_reader_intact(reader));
        }
    } else if (whisker_reader_peek(reader, &frames, &count) == WHISKER_OK && count > 0) {
        count = 1 + random / 4 % count;
        const uint64_t torn = count_torn(frames, count);
        judge(torn, count, whisker_reader_advance(reader, count));
    }
}

/* In a child: reads for ever, from ring to ring. */
static void read_until_killed(const char *name, uint64_t random)
{
    struct whisker_reader *reader;
    int error = whisker_reader_attach(name, PATIENCE_MS, &reader);
    while (error == WHISKER_OK) {
        read_some(reader, next_random(&random));
        const int state = whisker_reader_wait(reader, random % 2 ? PATIENCE_MS : 0);
        if (state == WHISKER_ERROR_WRITER_DEAD || state == WHISKER_ERROR_RESTARTED || state == WHISKER_ERROR_CLOSED) {
            error = whisker_reader_reattach(reader, PATIENCE_MS);
            atomic_fetch_add(&report->restarts, 1);
        } else if (state != WHISKER_OK && state != WHISKER_ERROR_TIMEOUT) {
            error = state;
        }
    }
    fprintf(stderr, "stress_ring: reader: %s\n", whisker_error_text(error));
    _exit(1);
}

/* In a child: makes the ring and publishes for ever, in batches of any size, with pauses in which readers fall asleep.
 */
static void write_until_killed(const char *name, uint64_t random)
{
    struct whisker_frame batch[CAPACITY / 4];
    struct whisker_ring *ring;
    const int error = whisker_ring_create(name, CAPACITY, &ring);
    if (error != WHISKER_OK) {
        fprintf(stderr, "stress_ring: writer: %s\n", whisker_error_text(error));
        _exit(1);
    }
    for (uint64_t tick = random >> 8;;) {
        const size_t count = 1 + next_random(&random) % (CAPACITY / 4);
        for (size_t i = 0; i < count; i++) {
            batch[i] = test_frame(tick++);
        }
        whisker_ring_publish(ring, batch, count);
        if (random % 64 == 0) {
            nanosleep(&(struct timespec){.tv_nsec = 50000}, NULL);
        }
    }
}

static pid_t start(const char *name, int slot, uint64_t random)
{
    const pid_t child = fork();
    if (child != 0) {
        return child;
    }
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (slot == 0) {
        write_until_killed(name, random);
    }
    read_until_killed(name, random);
    return -1;
}

/* Waits a random while, then kills. False: it had ended by itself, with a complaint. */
static bool kill_at_random(pid_t child, uint64_t random)
{
    int status;
    nanosleep(&(struct timespec){.tv_nsec = (long)(random % 400000)}, NULL);
    kill(child, SIGKILL);
    return waitpid(child, &status, 0) == child && WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL;
}

static bool run(const char *name, unsigned long kills, uint64_t random)
{
    pid_t children[1 + READERS];
    bool good = true;
    for (int slot = 0; slot <= READERS; slot++) {
        children[slot] = start(name, slot, next_random(&random));
    }
    for (unsigned long i = 0; i < kills && good; i++) {
        const int slot = (int)(next_random(&random) % (1 + READERS));
        good = kill_at_random(children[slot], next_random(&random));
        children[slot] = start(name, slot, next_random(&random));
    }
    for (int slot = READERS; slot >= 0; slot--) {
        good &= kill_at_random(children[slot], next_random(&random));
    }
    return good;
}

/* After all that a ring of the name is made, read and removed as if nothing had been. */
static bool goes_on(const char *name)
{
    struct whisker_ring *ring;
    struct whisker_reader *reader;
    if (whisker_ring_create(name, CAPACITY, &ring) != 0 || whisker_reader_attach(name, 0, &reader) != 0) {
        return false;
    }
    const struct whisker_frame *frames;
    test_publish(ring, 0, 3);
    const bool good = whisker_reader_window(reader, 3, &frames) == 3 && count_torn(frames, 3) == 0;
    whisker_reader_detach(reader);
    whisker_ring_close(ring);
    return good && !test_ring_file_exists(name);
}

int main(int argc, char **argv)
{
    const unsigned long kills = argc > 1 ? strtoul(argv[1], NULL, 10) : 2000;
    const uint64_t seed = argc > 2 ? strtoull(argv[2], NULL, 10) : (uint64_t)time(NULL);
    report = mmap(NULL, sizeof *report, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (report == MAP_FAILED) {
        return 1;
    }
    printf("stress_ring: %lu kills, seed %llu\n", kills, (unsigned long long)seed);
    fflush(stdout);
    const bool good =
        run(test_ring_name(), kills, seed * UINT64_C(0x9E3779B97F4A7C15) | 1) && goes_on(test_ring_name());
    printf("stress_ring: %lu frames accepted, %lu torn; %lu refused as overtaken; %lu changes of ring\n",
           atomic_load(&report->accepted), atomic_load(&report->torn), atomic_load(&report->refused),
           atomic_load(&report->restarts));
    const bool busy = atomic_load(&report->accepted) > kills && atomic_load(&report->restarts) > kills / 20;
    if (!good || !busy || atomic_load(&report->torn) > 0) {
        fprintf(stderr, "stress_ring: FAILED%s\n", busy ? "" : ": next to nothing happened");
        return 1;
    }
    return 0;
}
