/*
 * The bridge as a USB device: frames by asynchronous bulk transfers (libusb), control by HID feature reports (hidapi).
 *
 * Threads: a handle belongs to one thread at a time; different handles may be used by different threads at once.
 * Errors: 0 or a negative code of errors.h. Nothing here prints. From whisker_device_start on whisker_device_poll
 * allocates nothing itself (libusb keeps a small block for each transfer it queues).
 */
#ifndef WHISKER_DEVICE_H
#define WHISKER_DEVICE_H

#include <stddef.h>
#include <stdint.h>

#include "whisker/stats.h"

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)
struct whisker_device;

/* What the bridge says it is. */
struct whisker_identity {
    uint8_t wire_version;
    uint8_t lanes;
    uint8_t gateware;
    uint32_t clock_hz;
    uint16_t frame_bytes;
    uint16_t fifo_bytes;
    uint8_t board;       /* a number of `boards` in whisker.toml */
    uint8_t wired_lanes; /* that have a pin; 0: gateware before version 3 does not report it */
    uint16_t build;      /* first 16 bits of the gateware's commit; 0: not known */
};

/* Bits of options; all of them need gateware of version 3. */
#define WHISKER_OPTION_TICK_IN 1     /* ticks begin with edges of the pin tick_in, tick_period apart */
#define WHISKER_OPTION_FALLING 2     /* with its falling edges */
#define WHISKER_OPTION_EVERY_FRAME 4 /* each frame is sent at once; else a USB packet waits for its second frame */
#define WHISKER_OPTION_PATTERN 8     /* records of the bridge's own, whatever the lanes say: see whisker.toml */

/* How the bridge is to run; unit of all but mask and batch: cycle of its 60 MHz clock. */
struct whisker_settings {
    uint32_t lane_mask;   /* bit n: lane n is in use */
    uint32_t tick_period; /* 4000 or more; 30000 = 500 us */
    uint8_t sck_divider;  /* one SCK period: even, 6 to 32 */
    uint8_t word_gap;     /* SCK idle between two words: 30 to 255 */
    uint8_t sample_point; /* MISO is read this long after the edge that shifted it: 1 to sck_divider */
    uint8_t batch;        /* frames of one USB transfer, even, 2 to 64: fewer come sooner, more cost less */
    uint8_t transfers;    /* that one whisker_device_poll() takes at most: for those who throw frames away. 0: as they
                             come, 64 KiB queued, which outlasts the pauses of a loaded machine */
    uint8_t options;      /* WHISKER_OPTION_* */
};

/* When the latest tick was, and what came in at tick_in since the start; meanings and units: report `timing` in
 * whisker.toml. */
struct whisker_timing {
    uint32_t tick;
    uint16_t usb_time;
    uint16_t sof_cycles;
    uint8_t level;
    uint32_t edges;
    uint32_t early;
    uint32_t silent;
    uint32_t uneven;
    uint32_t shortest;
};

/* The hardware's defaults (all 28 lanes, 500 us), and batches of 4: frames wait 2 ms at most for their transfer. */
void whisker_settings_default(struct whisker_settings *settings);

/*
 * The same limits that the bridge checks. Returns 0, or DEVICE_REFUSED and, in message (n bytes; may be NULL, 0), which
 * setting is wrong and what it may be.
 */
int whisker_settings_check(const struct whisker_settings *settings, char *message, size_t n);

/* ns from a tick to the earliest moment at which its frame can be sent: the next tick and its transfer from the nodes.
 */
int64_t whisker_settings_latency_ns(const struct whisker_settings *settings);

/* The wire version this library speaks. */
int whisker_wire_version(void);

/* A bridge on the bus. */
struct whisker_device_info {
    char serial[WHISKER_SERIAL_BYTES]; /* empty if it could not be read: then `error` says why */
    char path[32];                     /* where it is plugged in, as the kernel writes it: "1-2.4" */
    uint16_t usb_mbit;                 /* speed of its bus: 480, or 12; 0: not known */
    int error;                         /* 0, DEVICE_ACCESS, DEVICE_GONE, DEVICE_USB */
};

/*
 * Lists the bridges that are plugged in, also those in use or without permission; the first `room` of them go into
 * list. Returns how many there are, or DEVICE_USB, MEMORY.
 */
int whisker_device_list(struct whisker_device_info *list, int room);

/*
 * Opens a bridge and asks who it is. serial: which one; NULL: the first that can be opened. Returns 0 and the device,
 * or DEVICE_MISSING, DEVICE_SERIAL, DEVICE_TWINS, DEVICE_ACCESS, DEVICE_BUSY, DEVICE_USB, DEVICE_GONE, DEVICE_CONTROL,
 * WIRE_VERSION, DEVICE_IDENTITY, MEMORY; then *device is NULL.
 * identity: filled in also with WIRE_VERSION and DEVICE_IDENTITY, so that a message can name both sides.
 */
int whisker_device_open(const char *serial, struct whisker_device **device, struct whisker_identity *identity);

/* Serial number, place and speed of an open device; valid until it is closed. */
const struct whisker_device_info *whisker_device_about(const struct whisker_device *device);

/* Cancels what is under way and closes. NULL is allowed. Does not stop the bridge. */
void whisker_device_close(struct whisker_device *device);

/* Called with the bytes of the stream as they come, in whisker_device_poll; cut anywhere. */
typedef void (*whisker_sink)(void *context, const uint8_t *bytes, size_t count);

/*
 * Stops a bridge that still runs for a process that is gone and throws its frames away; queues the bulk transfers
 * (64 KiB: 128 ms at 2 kHz); then starts the bridge. May be called again after stop and flush.
 * Returns 0 or DEVICE_REFUSED, DEVICE_CONTROL, DEVICE_USB, DEVICE_GONE, MEMORY.
 */
int whisker_device_start(struct whisker_device *device, const struct whisker_settings *settings, whisker_sink sink,
                         void *context);

/* Handles what has come, or waits for it up to timeout_ms; a signal ends the wait. No allocation, no printing.
 * Returns 0, or DEVICE_GONE, DEVICE_USB: the stream has ended. */
int whisker_device_poll(struct whisker_device *device, int timeout_ms);

/* Tells the bridge to stop: it makes one more frame, with flag LAST. Poll on to receive it. 0, DEVICE_CONTROL,
 * DEVICE_GONE. */
int whisker_device_stop(struct whisker_device *device);

/* Ends the stream: bytes of transfers that were not yet full still reach the sink. */
void whisker_device_flush(struct whisker_device *device);

/* Asks when the latest tick was and how tick_in does; also while frames stream. 0, DEVICE_CONTROL (also of gateware
 * before version 3), DEVICE_GONE. */
int whisker_device_timing(struct whisker_device *device, struct whisker_timing *timing);

/*
 * What is wrong with tick_in, by two reports of one run (the first may be all zeros), a few periods apart at least: 0,
 * TICK_IN_SILENT, TICK_IN_FAST, TICK_IN_GAP, TICK_IN_UNEVEN, in this order of precedence.
 */
int whisker_timing_judge(const struct whisker_timing *before, const struct whisker_timing *now);

struct whisker_hotplug;

/* Begins to watch for bridges being plugged in. Returns 0, or DEVICE_USB, MEMORY; then *hotplug is NULL. */
int whisker_hotplug_open(struct whisker_hotplug **hotplug);

/*
 * Waits until a bridge is there that was not reported yet; also reports one that is there every second, so that
 * opening it is tried again, and so that it works where no udev announces new devices. Returns 0: try to open; TIMEOUT
 * (also after a signal).
 */
int whisker_hotplug_wait(struct whisker_hotplug *hotplug, int timeout_ms);

/* NULL is allowed. */
void whisker_hotplug_close(struct whisker_hotplug *hotplug);
#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif
