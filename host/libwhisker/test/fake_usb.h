/* A bridge without USB: this test's own libusb and hidapi, as much of them as the library calls. */
#ifndef WHISKER_TEST_FAKE_USB_H
#define WHISKER_TEST_FAKE_USB_H

#include <libusb.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define FAKE_TRANSFERS 128

struct fake_usb {
    /* what the test sets */
    bool plugged, hid_refuses;
    bool gone;   /* unplugged while it was open: control transfers say so */
    int bridges; /* plugged in; their serial numbers are "0001", "0002", ... */
    bool twins;  /* all are "0001" */
    bool has_hid;
    int open_error, claim_error;
    uint16_t vendor, product; /* in its descriptor; 0: the protocol's */
    int speed;                /* LIBUSB_SPEED_* of its bus */
    uint8_t identity[16];
    int identity_bytes;
    uint8_t timing[32];
    bool running;
    int stale_reads; /* bulk reads that still give data after a stop */
    /* what the library did */
    int opened;    /* contexts, handles, interfaces, HID handles and transfers not given back */
    int hid_exits; /* ends of hidapi */
    int claimed;   /* number of the bridge last claimed */
    char hid_path[48];
    int in_flight;
    int64_t longest_wait_us; /* that events were waited for */
    void (*pump)(void);      /* called before events are handled, if set: a bridge that sends of its own accord */
    uint8_t control[16];
    char events[64]; /* in order: S start, X stop, q transfer queued, r synchronous read */
};

extern struct fake_usb fake;

/* A bridge as it should be, plugged in. */
void fake_reset(void);

/* A bridge is plugged in while a watcher waits: announced by an event, or not. */
void fake_plug(bool event);

/* Ends the oldest transfer in flight, at the next handling of events. */
void fake_complete(const void *bytes, size_t count, enum libusb_transfer_status status);

/* What the oldest transfer in flight holds when it is cancelled. */
void fake_hold(const void *bytes, size_t count);

#endif
