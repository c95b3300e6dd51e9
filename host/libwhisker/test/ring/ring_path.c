/*
 * The host's last part of a frame's way: an interrupt wakes a thread that waits in poll(), as libusb does, which
 * decodes a frame into the ring. The interrupt is a timer's, whose time is known, in place of the USB controller's.
 * Prints JSON: from the interrupt's due time to the frame in the ring, and the part of it that the thread itself works.
 * Usage: ring_path FRAMES LIMIT_US [PRIORITY]: how many come within the limit, too; PRIORITY: of SCHED_FIFO, else the
 * usual scheduling.
 */
#include <poll.h>
#include <sched.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/timerfd.h>
#include <time.h>
#include <unistd.h>

#include "frame_bytes.h"
#include "whisker/ring.h"
#include "whisker_protocol.h"

#define PERIOD_NS 500000
#define SECOND_NS 1000000000
#define RING_FRAMES 8192

static int64_t now_ns(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * SECOND_NS + now.tv_nsec;
}

static int compare(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static void print(const char *name, double *us, long count, double limit_us)
{
    qsort(us, (size_t)count, sizeof *us, compare);
    long within = 0;
    while (within < count && us[within] <= limit_us) {
        within++;
    }
    printf("\"%s\": {\"within_limit\": %.5f, \"median_us\": %.1f, \"p99_us\": %.1f, \"p999_us\": %.1f, \"worst_us\": "
           "%.1f}",
           name, (double)within / (double)count, us[count / 2], us[count * 99 / 100], us[count * 999 / 1000],
           us[count - 1]);
}

/* One frame for each expiry; those that come together are as late as the first of them was due. */
static void run(struct whisker_ring *ring, int timer, long count, double *late_us, double *work_us)
{
    struct whisker_decoder decoder;
    uint8_t bytes[WHISKER_FRAME_BYTES];
    int64_t due_ns = now_ns() + 20 * PERIOD_NS;
    const struct itimerspec every = {{.tv_nsec = PERIOD_NS},
                                     {.tv_sec = due_ns / SECOND_NS, .tv_nsec = due_ns % SECOND_NS}};
    whisker_decoder_init(&decoder);
    timerfd_settime(timer, TFD_TIMER_ABSTIME, &every, NULL);
    for (long i = 0; i < count; i++) {
        struct pollfd ready = {.fd = timer, .events = POLLIN};
        uint64_t expiries = 0;
        frame_bytes(bytes, (uint32_t)i, 0);
        poll(&ready, 1, -1);
        const int64_t woken_ns = now_ns();
        if (read(timer, &expiries, sizeof expiries) != sizeof expiries) {
            expiries = 1;
        }
        whisker_ring_feed(ring, &decoder, bytes, sizeof bytes, NULL, NULL);
        const int64_t done_ns = now_ns();
        late_us[i] = (double)(done_ns - due_ns) * 1e-3;
        work_us[i] = (double)(done_ns - woken_ns) * 1e-3;
        due_ns += (int64_t)expiries * PERIOD_NS;
    }
}

int main(int argc, char **argv)
{
    const long count = argc > 1 ? strtol(argv[1], NULL, 10) : 0;
    const struct sched_param priority = {.sched_priority = argc > 3 ? atoi(argv[3]) : 0};
    const double limit_us = argc > 2 ? strtod(argv[2], NULL) : 0;
    char name[64];
    struct whisker_ring *ring;
    const int timer = timerfd_create(CLOCK_MONOTONIC, 0);
    snprintf(name, sizeof name, "whisker-path-%d", (int)getpid());
    double *late_us = calloc((size_t)(count > 0 ? count : 1), 2 * sizeof *late_us);
    if (count <= 0 || limit_us <= 0 || !late_us || timer < 0 || whisker_ring_create(name, RING_FRAMES, &ring) != 0) {
        fprintf(stderr, "ring_path: give a number of frames and a limit in us, e.g. ring_path 20000 57\n");
        return 2;
    }
    if (priority.sched_priority > 0 &&
        (mlockall(MCL_CURRENT | MCL_FUTURE) != 0 || sched_setscheduler(0, SCHED_FIFO, &priority) != 0)) {
        fprintf(stderr, "ring_path: SCHED_FIFO is not allowed here; run it as root\n");
        return 1;
    }
    run(ring, timer, count, late_us, late_us + count);
    whisker_ring_close(ring);
    printf("{\"frames\": %ld, \"limit_us\": %.1f, \"fifo\": %s, ", count, limit_us,
           priority.sched_priority > 0 ? "true" : "false");
    print("late", late_us, count, limit_us);
    printf(", ");
    print("work", late_us + count, count, limit_us);
    printf("}\n");
    free(late_us);
    return 0;
}
