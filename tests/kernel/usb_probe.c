/* A libusb program for the guest: streams frames and checks each, and tries what a host may do to a device besides.
 * usage: usb_probe stream FRAMES | stall | cancel | reset | halt */
#include <stdbool.h>
#include <string.h>

#include <libusb.h>

#include "probe.h"
#include "whisker/whisker.h"

enum {
    HID_SET_REPORT_TYPE = 0x21,
    HID_SET_REPORT = 0x09,
    HID_FEATURE = 0x0300,
    VENDOR_REQUEST_TYPE = 0xC0, /* device to host, vendor, device: the bridge has none */
    TIMEOUT_MS = 60000,         /* the guest is emulated: seconds go by for nothing */
    TRANSFERS = 8,
    TRANSFER_BYTES = 4096,
    FRAMES_SOME = 300
};

static libusb_context *context;
static libusb_device_handle *device;

static void require(int result, const char *what)
{
    if (result < 0) {
        fail("%s: %s", what, libusb_error_name(result));
    }
}

static int set_run(uint8_t version, uint8_t run)
{
    uint8_t report[WHISKER_REPORT_CONTROL_BYTES];
    control_report(report, version, run);
    return libusb_control_transfer(device, HID_SET_REPORT_TYPE, HID_SET_REPORT, HID_FEATURE | WHISKER_REPORT_ID_CONTROL,
                                   WHISKER_LIMIT_USB_HID_INTERFACE, report, sizeof report, TIMEOUT_MS);
}

/* The HID interface too: the kernel lets nobody else send the report that starts the bridge. */
static void claim(void)
{
    require(libusb_claim_interface(device, WHISKER_LIMIT_USB_BULK_INTERFACE), "claim of the frames' interface");
    require(libusb_claim_interface(device, WHISKER_LIMIT_USB_HID_INTERFACE), "claim of the HID interface");
}

static void open_bridge(void)
{
    require(libusb_init(&context), "libusb_init");
    device = libusb_open_device_with_vid_pid(context, WHISKER_LIMIT_USB_VENDOR_ID, WHISKER_LIMIT_USB_PRODUCT_ID);
    if (!device) {
        fail("libusb finds no bridge, or may not open it");
    }
    require(libusb_set_auto_detach_kernel_driver(device, 1), "detaching of kernel drivers");
    claim();
}

/* Gives the HID interface back to the kernel's driver. */
static void close_bridge(void)
{
    libusb_release_interface(device, WHISKER_LIMIT_USB_BULK_INTERFACE);
    libusb_release_interface(device, WHISKER_LIMIT_USB_HID_INTERFACE);
    libusb_close(device);
    libusb_exit(context);
}

/* ----------------------------------------------------------------------------------------------------- streaming */

struct stream {
    struct whisker_decoder decoder;
    uint64_t frames;
    uint32_t sequence;
    int in_flight;
    bool stopping, last;
    int error; /* of a transfer */
};

static void check_frame(struct stream *stream, const struct whisker_frame *frame)
{
    if (stream->frames > 0 && frame->sequence != stream->sequence + 1) {
        fail("sequence %u follows %u", frame->sequence, stream->sequence);
    }
    if (frame->tick != stream->frames) {
        fail("tick %llu where %llu was due", (unsigned long long)frame->tick, (unsigned long long)stream->frames);
    }
    stream->sequence = frame->sequence;
    stream->frames++;
    stream->last = (frame->flags & WHISKER_FRAME_LAST) != 0;
}

static void take_bytes(struct stream *stream, const uint8_t *bytes, size_t count)
{
    struct whisker_frame frame;
    while (whisker_decoder_next(&stream->decoder, &bytes, &count, &frame)) {
        check_frame(stream, &frame);
    }
}

static void LIBUSB_CALL on_transfer(struct libusb_transfer *transfer)
{
    struct stream *stream = transfer->user_data;
    take_bytes(stream, transfer->buffer, (size_t)transfer->actual_length);
    const bool good = transfer->status == LIBUSB_TRANSFER_COMPLETED;
    if (!good && transfer->status != LIBUSB_TRANSFER_CANCELLED) {
        stream->error = (int)transfer->status;
    }
    if (!good || stream->last || libusb_submit_transfer(transfer) != 0) {
        stream->in_flight--;
    }
}

static void submit_all(struct stream *stream, struct libusb_transfer **transfers)
{
    for (int i = 0; i < TRANSFERS; i++) {
        transfers[i] = libusb_alloc_transfer(0);
        uint8_t *buffer = malloc(TRANSFER_BYTES);
        libusb_fill_bulk_transfer(transfers[i], device, WHISKER_LIMIT_USB_BULK_IN, buffer, TRANSFER_BYTES, on_transfer,
                                  stream, 0);
        transfers[i]->flags = LIBUSB_TRANSFER_FREE_BUFFER;
        require(libusb_submit_transfer(transfers[i]), "submission of a transfer");
        stream->in_flight++;
    }
}

static void finish(struct stream *stream, struct libusb_transfer **transfers)
{
    for (int i = 0; i < TRANSFERS; i++) {
        libusb_cancel_transfer(transfers[i]);
    }
    while (stream->in_flight > 0) {
        libusb_handle_events(context);
    }
    for (int i = 0; i < TRANSFERS; i++) {
        libusb_free_transfer(transfers[i]);
    }
}

static void check_decoder(const struct whisker_decoder_counts *counts)
{
    if (counts->bytes_skipped + counts->truncated + counts->frames_damaged != 0) {
        fail("%llu bytes were no frame, %llu frames cut, %llu with damaged records",
             (unsigned long long)counts->bytes_skipped, (unsigned long long)counts->truncated,
             (unsigned long long)counts->frames_damaged);
    }
}

/* A run from start to stop: every frame from the first to the one marked last, each checked. */
static void stream(uint64_t wanted)
{
    struct stream stream = {0};
    struct libusb_transfer *transfers[TRANSFERS];
    whisker_decoder_init(&stream.decoder);
    require(set_run(WHISKER_WIRE_VERSION, 1), "start");
    submit_all(&stream, transfers);
    while (!stream.last && stream.in_flight > 0) {
        libusb_handle_events(context);
        if (stream.frames >= wanted && !stream.stopping) {
            stream.stopping = true;
            require(set_run(WHISKER_WIRE_VERSION, 0), "stop");
        }
    }
    finish(&stream, transfers);
    whisker_decoder_end(&stream.decoder);
    check_decoder(&stream.decoder.counts);
    if (!stream.last || stream.frames < wanted) {
        fail("the stream ended after %llu frames, transfer status %d", (unsigned long long)stream.frames, stream.error);
    }
    printf("%llu frames\n", (unsigned long long)stream.frames);
}

/* -------------------------------------------------------------------------------------------------------- the rest */

/* Requests the bridge does not know, or refuses, are answered by STALL, and the next one is served. */
static void stall(void)
{
    uint8_t bytes[8];
    const int unknown =
        libusb_control_transfer(device, VENDOR_REQUEST_TYPE, 0x55, 0, 0, bytes, sizeof bytes, TIMEOUT_MS);
    if (unknown != LIBUSB_ERROR_PIPE) {
        fail("an unknown request ends with %s", unknown >= 0 ? "data" : libusb_error_name(unknown));
    }
    const int refused = set_run(WHISKER_WIRE_VERSION + 1, 1);
    if (refused != LIBUSB_ERROR_PIPE) {
        fail("a report of another wire version ends with %s", refused >= 0 ? "OK" : libusb_error_name(refused));
    }
    require(libusb_clear_halt(device, WHISKER_LIMIT_USB_BULK_IN), "CLEAR_FEATURE(ENDPOINT_HALT)");
    stream(FRAMES_SOME);
}

/* A transfer that nothing comes for ends when it is cancelled; and one by its time-out. */
static void cancel(void)
{
    struct stream waiting = {0};
    struct libusb_transfer *transfers[TRANSFERS];
    uint8_t bytes[WHISKER_LIMIT_BULK_PACKET];
    int count = 0;
    submit_all(&waiting, transfers);
    finish(&waiting, transfers);
    if (waiting.error != 0 || waiting.decoder.held != 0) {
        fail("cancelled transfers end with status %d", waiting.error);
    }
    const int late = libusb_bulk_transfer(device, WHISKER_LIMIT_USB_BULK_IN, bytes, sizeof bytes, &count, 100);
    if (late != LIBUSB_ERROR_TIMEOUT || count != 0) {
        fail("a read that nothing comes for ends with %s", libusb_error_name(late));
    }
    stream(FRAMES_SOME);
}

/* A reset in the midst of a run ends it, and no frame of before comes after. */
static void reset(void)
{
    uint8_t bytes[TRANSFER_BYTES];
    int count = 0;
    require(set_run(WHISKER_WIRE_VERSION, 1), "start");
    require(libusb_bulk_transfer(device, WHISKER_LIMIT_USB_BULK_IN, bytes, sizeof bytes, &count, TIMEOUT_MS), "read");
    require(libusb_reset_device(device), "reset");
    claim();
    stream(FRAMES_SOME);
}

/* So many more frames by reads one after the other. */
static void read_on(struct stream *stream, uint64_t frames)
{
    const uint64_t wanted = stream->frames + frames;
    while (stream->frames < wanted && !stream->last) {
        uint8_t bytes[TRANSFER_BYTES];
        int count = 0;
        require(libusb_bulk_transfer(device, WHISKER_LIMIT_USB_BULK_IN, bytes, sizeof bytes, &count, TIMEOUT_MS),
                "read");
        take_bytes(stream, bytes, (size_t)count);
    }
}

/* In the midst of a run the host halts the frames' endpoint and lets it go, then sets the interface anew: no frame is
 * lost, none comes twice. */
static void halt(void)
{
    struct stream stream = {0};
    uint8_t bytes[TRANSFER_BYTES];
    int count = 0;
    whisker_decoder_init(&stream.decoder);
    require(set_run(WHISKER_WIRE_VERSION, 1), "start");
    read_on(&stream, FRAMES_SOME);
    require(libusb_control_transfer(device, LIBUSB_RECIPIENT_ENDPOINT, LIBUSB_REQUEST_SET_FEATURE, 0,
                                    WHISKER_LIMIT_USB_BULK_IN, NULL, 0, TIMEOUT_MS),
            "SET_FEATURE(ENDPOINT_HALT)");
    const int halted = libusb_bulk_transfer(device, WHISKER_LIMIT_USB_BULK_IN, bytes, sizeof bytes, &count, TIMEOUT_MS);
    if (halted != LIBUSB_ERROR_PIPE || count != 0) {
        fail("a read of a halted endpoint ends with %s, %d bytes", libusb_error_name(halted), count);
    }
    require(libusb_clear_halt(device, WHISKER_LIMIT_USB_BULK_IN), "CLEAR_FEATURE(ENDPOINT_HALT)");
    read_on(&stream, FRAMES_SOME);
    require(libusb_set_interface_alt_setting(device, WHISKER_LIMIT_USB_BULK_INTERFACE, 0), "SET_INTERFACE");
    read_on(&stream, FRAMES_SOME);
    require(set_run(WHISKER_WIRE_VERSION, 0), "stop");
    while (!stream.last) {
        read_on(&stream, 1);
    }
    whisker_decoder_end(&stream.decoder);
    check_decoder(&stream.decoder.counts);
    printf("%llu frames\n", (unsigned long long)stream.frames);
}

int main(int argc, char **argv)
{
    const char *what = argc > 1 ? argv[1] : "";
    open_bridge();
    if (!strcmp(what, "stream") && argc == 3) {
        stream(strtoull(argv[2], NULL, 10));
    } else if (!strcmp(what, "stall")) {
        stall();
    } else if (!strcmp(what, "cancel")) {
        cancel();
    } else if (!strcmp(what, "reset")) {
        reset();
    } else if (!strcmp(what, "halt")) {
        halt();
    } else {
        fail("usage: usb_probe stream FRAMES | stall | cancel | reset | halt");
    }
    close_bridge();
    return EXIT_SUCCESS;
}
