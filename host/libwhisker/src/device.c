#include "whisker/device.h"

#include <libusb.h>
#include <stdbool.h>
#include <stdlib.h>

#include "control.h"
#include "whisker/errors.h"
#include "whisker_protocol.h"

/* 64 KiB queued: a quarter of a second at 2 kHz, more than the gaps a loaded machine was seen to make (61 ms). */
#define TRANSFERS 16
#define TRANSFER_BYTES 4096
/* What a stopped bridge still holds comes without a pause; this much silence means that it is empty. */
#define STALE_TIMEOUT_MS 100

struct whisker_device {
    libusb_context *usb;
    libusb_device_handle *handle;
    hid_device *hid;
    struct libusb_transfer *transfer[TRANSFERS];
    int active;  /* transfers the kernel holds */
    int error;   /* why the stream has ended */
    bool ending; /* do not queue again */
    bool claimed;
    struct whisker_settings settings;
    whisker_sink sink;
    void *context;
    uint8_t buffer[TRANSFERS][TRANSFER_BYTES];
};

static int usb_error(int error)
{
    switch (error) {
    case LIBUSB_ERROR_ACCESS:
        return WHISKER_ERROR_DEVICE_ACCESS;
    case LIBUSB_ERROR_BUSY:
        return WHISKER_ERROR_DEVICE_BUSY;
    case LIBUSB_ERROR_NO_DEVICE:
        return WHISKER_ERROR_DEVICE_GONE;
    case LIBUSB_ERROR_NO_MEM:
        return WHISKER_ERROR_MEMORY;
    default:
        return WHISKER_ERROR_DEVICE_USB;
    }
}

static bool is_bridge(libusb_device *candidate)
{
    struct libusb_device_descriptor about;
    return libusb_get_device_descriptor(candidate, &about) == 0 && about.idVendor == WHISKER_LIMIT_USB_VENDOR_ID &&
           about.idProduct == WHISKER_LIMIT_USB_PRODUCT_ID;
}

static int open_first(struct whisker_device *device)
{
    libusb_device **list;
    const ssize_t count = libusb_get_device_list(device->usb, &list);
    if (count < 0) {
        return usb_error((int)count);
    }
    int error = WHISKER_ERROR_DEVICE_MISSING;
    for (ssize_t i = 0; i < count && error == WHISKER_ERROR_DEVICE_MISSING; i++) {
        if (is_bridge(list[i])) {
            const int opened = libusb_open(list[i], &device->handle);
            error = opened ? usb_error(opened) : WHISKER_OK;
        }
    }
    libusb_free_device_list(list, 1);
    return error;
}

static int open_usb(struct whisker_device *device)
{
    if (libusb_init(&device->usb) != 0) {
        device->usb = NULL;
        return WHISKER_ERROR_DEVICE_USB;
    }
    const int error = open_first(device);
    if (error) {
        return error;
    }
    const int claimed = libusb_claim_interface(device->handle, WHISKER_LIMIT_USB_BULK_INTERFACE);
    device->claimed = claimed == 0;
    return claimed ? usb_error(claimed) : WHISKER_OK;
}

/* The bytes of a transfer that did not fill up are as good as any other's. */
static void LIBUSB_CALL on_transfer(struct libusb_transfer *transfer)
{
    struct whisker_device *device = transfer->user_data;
    device->active--;
    if (transfer->actual_length > 0) {
        device->sink(device->context, transfer->buffer, (size_t)transfer->actual_length);
    }
    if (transfer->status == LIBUSB_TRANSFER_COMPLETED && !device->ending) {
        const int error = libusb_submit_transfer(transfer);
        device->active += error == 0;
        device->error = error ? usb_error(error) : device->error;
    } else if (transfer->status == LIBUSB_TRANSFER_NO_DEVICE) {
        device->error = WHISKER_ERROR_DEVICE_GONE;
    } else if (transfer->status != LIBUSB_TRANSFER_CANCELLED && transfer->status != LIBUSB_TRANSFER_COMPLETED) {
        device->error = WHISKER_ERROR_DEVICE_USB;
    }
}

static int make_transfers(struct whisker_device *device)
{
    for (int i = 0; i < TRANSFERS; i++) {
        device->transfer[i] = libusb_alloc_transfer(0);
        if (!device->transfer[i]) {
            return WHISKER_ERROR_MEMORY;
        }
        libusb_fill_bulk_transfer(device->transfer[i], device->handle, WHISKER_LIMIT_USB_BULK_IN, device->buffer[i],
                                  TRANSFER_BYTES, on_transfer, device, 0);
    }
    return WHISKER_OK;
}

static int open_all(struct whisker_device *device, struct whisker_identity *identity)
{
    int error = open_usb(device);
    if (!error) {
        error = make_transfers(device);
    }
    if (error) {
        return error;
    }
    device->hid = control_open();
    return device->hid ? control_identify(device->hid, identity) : WHISKER_ERROR_DEVICE_CONTROL;
}

int whisker_device_open(struct whisker_device **device, struct whisker_identity *identity)
{
    *device = NULL;
    *identity = (struct whisker_identity){0};
    struct whisker_device *opened = calloc(1, sizeof *opened);
    if (!opened) {
        return WHISKER_ERROR_MEMORY;
    }
    whisker_settings_default(&opened->settings);
    const int error = open_all(opened, identity);
    if (error) {
        whisker_device_close(opened);
        return error;
    }
    *device = opened;
    return WHISKER_OK;
}

static void handle_events(struct whisker_device *device, int timeout_ms)
{
    struct timeval timeout = {.tv_sec = timeout_ms / 1000, .tv_usec = timeout_ms % 1000 * 1000};
    libusb_handle_events_timeout_completed(device->usb, &timeout, NULL);
}

void whisker_device_flush(struct whisker_device *device)
{
    device->ending = true;
    /* Last first: were an earlier one cancelled before a later, data could still fill the later and overtake it. */
    for (int i = TRANSFERS - 1; i >= 0 && device->active > 0; i--) {
        libusb_cancel_transfer(device->transfer[i]);
    }
    while (device->active > 0) {
        handle_events(device, STALE_TIMEOUT_MS);
    }
}

void whisker_device_close(struct whisker_device *device)
{
    if (!device) {
        return;
    }
    whisker_device_flush(device);
    for (int i = 0; i < TRANSFERS; i++) {
        libusb_free_transfer(device->transfer[i]);
    }
    if (device->hid) {
        hid_close(device->hid);
    }
    hid_exit();
    if (device->claimed) {
        libusb_release_interface(device->handle, WHISKER_LIMIT_USB_BULK_INTERFACE);
    }
    if (device->handle) {
        libusb_close(device->handle);
    }
    if (device->usb) {
        libusb_exit(device->usb);
    }
    free(device);
}

/* A process that was killed leaves the bridge running and its FIFO full. */
static int discard_stale(struct whisker_device *device)
{
    struct whisker_counters counters;
    int error = control_counters(device->hid, &counters);
    if (error || !counters.running) {
        return error;
    }
    error = whisker_device_stop(device);
    int got = 1;
    while (!error && got > 0) {
        libusb_bulk_transfer(device->handle, WHISKER_LIMIT_USB_BULK_IN, device->buffer[0], TRANSFER_BYTES, &got,
                             STALE_TIMEOUT_MS);
    }
    return error;
}

int whisker_device_start(struct whisker_device *device, const struct whisker_settings *settings, whisker_sink sink,
                         void *context)
{
    int error = discard_stale(device);
    if (error) {
        return error;
    }
    device->settings = *settings;
    device->sink = sink;
    device->context = context;
    device->error = WHISKER_OK;
    device->ending = false;
    for (int i = 0; i < TRANSFERS; i++) {
        error = libusb_submit_transfer(device->transfer[i]);
        if (error) {
            return usb_error(error);
        }
        device->active++;
    }
    return control_run(device->hid, &device->settings, true);
}

int whisker_device_poll(struct whisker_device *device, int timeout_ms)
{
    handle_events(device, timeout_ms);
    return device->error;
}

int whisker_device_stop(struct whisker_device *device)
{
    return control_run(device->hid, &device->settings, false) ? WHISKER_ERROR_DEVICE_CONTROL : WHISKER_OK;
}

int whisker_device_counters(struct whisker_device *device, struct whisker_counters *counters)
{
    return control_counters(device->hid, counters);
}
