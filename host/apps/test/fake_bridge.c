/*
 * A bridge for whiskerd's tests. WHISKER_FAKE says what is the matter with it: access, busy, gone, version, lanes; or
 * with its pin tick_in: silent, fast; or
 * with the host's clock: realtime, monotonic go back by an hour. It sends 4000 frames, ends the daemon, and sends the
 * last frame.
 */
#include <signal.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "fake_usb.h"
#include "frame_bytes.h"
#include "whisker_protocol.h"

#define FRAMES 4000
#define BATCH 4
#define BACK_S 3600

static uint32_t sent;
static int clock_set = -1; /* that goes back when half the frames are sent */

int __real_clock_gettime(clockid_t clock, struct timespec *now);
int __wrap_clock_gettime(clockid_t clock, struct timespec *now);

int __wrap_clock_gettime(clockid_t clock, struct timespec *now)
{
    const int result = __real_clock_gettime(clock, now);
    now->tv_sec += BACK_S; /* so that also the back-set one is positive on a machine that has just started */
    now->tv_sec -= clock == clock_set && sent >= FRAMES / 2 ? BACK_S : 0;
    return result;
}

static void send_frames(uint32_t count, uint8_t flags)
{
    uint8_t bytes[BATCH * WHISKER_FRAME_BYTES];
    for (uint32_t i = 0; i < count; i++) {
        frame_bytes(bytes + i * WHISKER_FRAME_BYTES, sent++, flags);
    }
    fake_complete(bytes, count * WHISKER_FRAME_BYTES, LIBUSB_TRANSFER_COMPLETED);
}

static void pump(void)
{
    const bool stopped = fake.events[0] && fake.events[strlen(fake.events) - 1] == 'X';
    if (sent < FRAMES && fake.in_flight > 0) {
        send_frames(BATCH, 0);
    } else if (sent == FRAMES && stopped) {
        send_frames(1, WHISKER_FRAME_FLAG_LAST);
    } else if (sent == FRAMES) {
        kill(getpid(), SIGTERM);
    }
}

__attribute__((constructor)) static void choose(void)
{
    const char *what = getenv("WHISKER_FAKE");
    what = what ? what : "";
    fake_reset();
    fake.pump = pump;
    fake.open_error = !strcmp(what, "access") ? LIBUSB_ERROR_ACCESS : 0;
    fake.claim_error = !strcmp(what, "busy") ? LIBUSB_ERROR_BUSY : 0;
    fake.gone = !strcmp(what, "gone");
    if (!strcmp(what, "version")) {
        fake.identity[WHISKER_REPORT_IDENTITY_WIRE_VERSION] = WHISKER_WIRE_VERSION + 1;
    } else if (!strcmp(what, "lanes")) {
        fake.identity[WHISKER_REPORT_IDENTITY_LANES] = WHISKER_LIMIT_LANES - 1;
    }
    fake.timing[WHISKER_REPORT_TIMING_SILENT] = !strcmp(what, "silent");
    fake.timing[WHISKER_REPORT_TIMING_EARLY] = !strcmp(what, "fast");
    clock_set = !strcmp(what, "realtime") ? CLOCK_REALTIME : !strcmp(what, "monotonic") ? CLOCK_MONOTONIC : -1;
}
