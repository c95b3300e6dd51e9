/*
 * The bridge as a USB device: frames by asynchronous bulk transfers (libusb), control by HID feature reports (hidapi).
 * A handle belongs to one thread at a time. Errors: 0 or a negative code of errors.h.
 */
#ifndef WHISKER_DEVICE_H
#define WHISKER_DEVICE_H

#include <stddef.h>
#include <stdint.h>

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
};

/* How the bridge is to run; unit of all but the mask: cycle of its 60 MHz clock. */
struct whisker_settings {
    uint32_t lane_mask;   /* bit n: lane n is in use */
    uint32_t tick_period; /* 4000 or more; 30000 = 500 us */
    uint8_t sck_divider;  /* one SCK period: even, 6 to 32 */
    uint8_t word_gap;     /* SCK idle between two words: 30 to 255 */
    uint8_t sample_point; /* MISO is read this long after the edge that shifted it: 1 to sck_divider */
};

/* The bridge's own counts since its start. */
struct whisker_counters {
    uint8_t running;
    uint32_t ticks;
    uint32_t frames;
    uint32_t dropped;
    uint32_t records_good;
    uint32_t records_absent;
    uint32_t records_crc;
    uint32_t records_tick;
};

/* The hardware's defaults (all 28 lanes, 500 us). */
void whisker_settings_default(struct whisker_settings *settings);

/*
 * The same limits that the bridge checks. Returns 0, or DEVICE_REFUSED and, in message (n bytes; may be NULL, 0), which
 * setting is wrong and what it may be.
 */
int whisker_settings_check(const struct whisker_settings *settings, char *message, size_t n);

/* The wire version this library speaks. */
int whisker_wire_version(void);

/*
 * Opens the first bridge found and asks who it is. Returns 0 and the device, or DEVICE_MISSING, DEVICE_ACCESS,
 * DEVICE_BUSY, DEVICE_USB, DEVICE_CONTROL, WIRE_VERSION, DEVICE_IDENTITY, MEMORY; then *device is NULL.
 * identity: filled in also with WIRE_VERSION and DEVICE_IDENTITY, so that a message can name both sides.
 */
int whisker_device_open(struct whisker_device **device, struct whisker_identity *identity);

/* Cancels what is under way and closes. NULL is allowed. Does not stop the bridge. */
void whisker_device_close(struct whisker_device *device);

/* Called with the bytes of the stream as they come, in whisker_device_poll; cut anywhere. */
typedef void (*whisker_sink)(void *context, const uint8_t *bytes, size_t count);

/*
 * Stops a bridge that still runs for a process that is gone and throws its frames away; queues the bulk transfers; then
 * starts the bridge. Returns 0 or DEVICE_REFUSED, DEVICE_CONTROL, DEVICE_USB, DEVICE_GONE.
 */
int whisker_device_start(struct whisker_device *device, const struct whisker_settings *settings, whisker_sink sink,
                         void *context);

/* Handles what has come, or waits for it up to timeout_ms; a signal ends the wait. No allocation, no printing.
 * Returns 0, or DEVICE_GONE, DEVICE_USB: the stream has ended. */
int whisker_device_poll(struct whisker_device *device, int timeout_ms);

/* Tells the bridge to stop: it makes one more frame, with flag LAST. Poll on to receive it. */
int whisker_device_stop(struct whisker_device *device);

/* Ends the stream: bytes of transfers that were not yet full still reach the sink. */
void whisker_device_flush(struct whisker_device *device);

/* Asks for the bridge's counters; also while frames stream. */
int whisker_device_counters(struct whisker_device *device, struct whisker_counters *counters);
#pragma GCC visibility pop

#endif
