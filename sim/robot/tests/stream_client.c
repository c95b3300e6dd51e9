/* A small host program for the tests: starts the bridge, writes the bulk stream to a file as it comes, stops at
 * SIGTERM. usage: stream_client OUT.bin TRANSFER_BYTES TIMEOUT_MS. Short time-outs make libusb discard transfers all
 * the time. */
#define _POSIX_C_SOURCE 200809L
#include <signal.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <libusb.h>

#include "whisker_protocol.h"

enum { HID_SET_REPORT_TYPE = 0x21, HID_SET_REPORT = 0x09, HID_FEATURE = 0x0300, CONTROL_TIMEOUT_MS = 10000 };

/* SIGTERM stays blocked: umockdev's ioctl sets errno, then sleeps for a moment, and a signal in that moment turns
 * EAGAIN into EINTR, upon which libusb cancels the transfer and reports an input/output error. */
static bool block_sigterm(sigset_t *set)
{
    sigemptyset(set);
    sigaddset(set, SIGTERM);
    return sigprocmask(SIG_BLOCK, set, NULL) == 0;
}

static bool reported_to_stop(void)
{
    sigset_t waiting;
    return sigpending(&waiting) == 0 && sigismember(&waiting, SIGTERM) == 1;
}

static int send_report(libusb_device_handle *device, uint8_t version, uint8_t run)
{
    uint8_t report[WHISKER_REPORT_CONTROL_BYTES] = {0};
    report[WHISKER_REPORT_CONTROL_ID] = WHISKER_REPORT_ID_CONTROL;
    report[WHISKER_REPORT_CONTROL_WIRE_VERSION] = version;
    report[WHISKER_REPORT_CONTROL_RUN] = run;
    report[WHISKER_REPORT_CONTROL_SCK_DIVIDER] = WHISKER_LIMIT_SCK_DIVIDER_MIN;
    report[WHISKER_REPORT_CONTROL_WORD_GAP] = WHISKER_LIMIT_WORD_GAP_MIN;
    report[WHISKER_REPORT_CONTROL_SAMPLE_POINT] = WHISKER_LIMIT_SCK_DIVIDER_MIN - 1;
    whisker_put_u32(report + WHISKER_REPORT_CONTROL_LANE_MASK, (UINT32_C(1) << WHISKER_LIMIT_LANES) - 1);
    whisker_put_u32(report + WHISKER_REPORT_CONTROL_TICK_PERIOD, WHISKER_LIMIT_TICK_PERIOD);
    return libusb_control_transfer(device, HID_SET_REPORT_TYPE, HID_SET_REPORT, HID_FEATURE | WHISKER_REPORT_ID_CONTROL,
                                   WHISKER_LIMIT_USB_HID_INTERFACE, report, sizeof report, CONTROL_TIMEOUT_MS);
}

/* Was the last whole frame of the bytes so far the run's last? */
static bool last_seen(const uint8_t *frame)
{
    return (frame[WHISKER_FRAME_HEADER_FLAGS] & WHISKER_FRAME_FLAG_LAST) != 0;
}

static int stream(libusb_device_handle *device, FILE *file, int size, unsigned timeout_ms)
{
    static uint8_t buffer[65536];
    uint8_t frame[WHISKER_FRAME_BYTES];
    size_t total = 0;
    bool stopped = false;
    for (bool last = false; !last;) {
        int count = 0;
        const int result = libusb_bulk_transfer(device, WHISKER_LIMIT_USB_BULK_IN, buffer, size, &count, timeout_ms);
        if (result != 0 && result != LIBUSB_ERROR_TIMEOUT && result != LIBUSB_ERROR_INTERRUPTED) {
            fprintf(stderr, "stream_client: %s\n", libusb_error_name(result));
            return EXIT_FAILURE;
        }
        fwrite(buffer, 1, (size_t)count, file);
        for (int i = 0; i < count; i++) {
            frame[total++ % sizeof frame] = buffer[i];
            last = total % sizeof frame == 0 && last_seen(frame);
        }
        if (!stopped && reported_to_stop()) {
            stopped = send_report(device, WHISKER_WIRE_VERSION, 0) > 0;
        }
    }
    return EXIT_SUCCESS;
}

/* A report with another wire version must be refused by STALL, which usbfs shows as a pipe error. */
static bool wrong_version_is_refused(libusb_device_handle *device)
{
    return send_report(device, WHISKER_WIRE_VERSION + 1, 1) == LIBUSB_ERROR_PIPE;
}

static libusb_device_handle *open_bridge(void)
{
    libusb_device_handle *device =
        libusb_open_device_with_vid_pid(NULL, WHISKER_LIMIT_USB_VENDOR_ID, WHISKER_LIMIT_USB_PRODUCT_ID);
    return device && libusb_claim_interface(device, WHISKER_LIMIT_USB_BULK_INTERFACE) == 0 ? device : NULL;
}

/* Another handle is another file: it cannot claim what this one has, until this one gives it back. */
static bool claims_exclude(libusb_device_handle *device)
{
    libusb_device_handle *other =
        libusb_open_device_with_vid_pid(NULL, WHISKER_LIMIT_USB_VENDOR_ID, WHISKER_LIMIT_USB_PRODUCT_ID);
    const int while_claimed = libusb_claim_interface(other, WHISKER_LIMIT_USB_BULK_INTERFACE);
    const int given_back = libusb_release_interface(device, WHISKER_LIMIT_USB_BULK_INTERFACE);
    const int afterwards = libusb_claim_interface(other, WHISKER_LIMIT_USB_BULK_INTERFACE);
    libusb_release_interface(other, WHISKER_LIMIT_USB_BULK_INTERFACE);
    libusb_close(other);
    return while_claimed == LIBUSB_ERROR_BUSY && given_back == 0 && afterwards == 0 &&
           libusb_claim_interface(device, WHISKER_LIMIT_USB_BULK_INTERFACE) == 0;
}

int main(int argc, char **argv)
{
    FILE *file = argc == 4 ? fopen(argv[1], "wb") : NULL;
    sigset_t blocked;
    if (!file || !block_sigterm(&blocked) || libusb_init(NULL) != 0) {
        return EXIT_FAILURE;
    }
    libusb_device_handle *device = open_bridge();
    if (!device || !wrong_version_is_refused(device) || !claims_exclude(device) ||
        send_report(device, WHISKER_WIRE_VERSION, 1) < 0) {
        fprintf(stderr, "stream_client: the bridge does not start\n");
        return EXIT_FAILURE;
    }
    const int result = stream(device, file, atoi(argv[2]), (unsigned)atoi(argv[3]));
    libusb_close(device);
    libusb_exit(NULL);
    return fclose(file) == 0 ? result : EXIT_FAILURE;
}
