#include "whisker/device.h"

#include <stdbool.h>
#include <stdlib.h>

#include "control.h"
#include "device_service.h"
#include "discovery.h"
#include "whisker/errors.h"
#include "whisker_protocol.h"

/* 64 KiB queued: 128 ms at 2 kHz, more than the gaps a loaded machine was seen to make (61 ms). */
#define QUEUED_BYTES 65536
#define BATCH_MIN 2 /* frames: one packet */
#define TRANSFERS_MAX ((int)(QUEUED_BYTES / (BATCH_MIN * WHISKER_FRAME_BYTES)))
/* What a stopped bridge still holds comes without a pause; this much silence means that it is empty. */
#define STALE_TIMEOUT_MS 100
#define STALE_BYTES 4096
#define STATUS_TIMEOUT_MS 1000

struct whisker_device {
    libusb_context *usb;
    libusb_device_handle *handle;
    hid_device *hid;
    struct whisker_device_info about;
    struct libusb_transfer *transfer[TRANSFERS_MAX];
    int transfers; /* of them in use: what the batch divides QUEUED_BYTES into, or fewer if the settings say so */
    int active;    /* transfers the kernel holds */
    int idle;      /* that are to be handed to it anew, in their turn */
    int turn;      /* whose it is */
    int error;     /* why the stream has ended */
    bool ending;   /* do not queue again */
    struct whisker_settings settings;
    whisker_sink sink;
    void *context;
    uint8_t buffer[QUEUED_BYTES];
};

/* hidapi says only that something failed. Is the bridge still there? Asks for its status (USB 2.0, 9.4.5). */
static int device_blame(struct whisker_device *device, int error)
{
    uint8_t status[2];
    if (error != WHISKER_ERROR_DEVICE_CONTROL && error != WHISKER_ERROR_DEVICE_REFUSED) {
        return error;
    }
    const int got = libusb_control_transfer(device->handle, LIBUSB_ENDPOINT_IN, LIBUSB_REQUEST_GET_STATUS, 0, 0, status,
                                            sizeof status, STATUS_TIMEOUT_MS);
    return got == LIBUSB_ERROR_NO_DEVICE ? WHISKER_ERROR_DEVICE_GONE : error;
}

static void device_submit(struct whisker_device *device, struct libusb_transfer *transfer)
{
    const int error = libusb_submit_transfer(transfer);
    device->active += error == 0;
    device->error = error ? usb_error(error) : device->error;
}

/* The bytes of a transfer that did not fill up are as good as any other's. */
static void LIBUSB_CALL device_on_transfer(struct libusb_transfer *transfer)
{
    struct whisker_device *device = transfer->user_data;
    device->active--;
    if (transfer->actual_length > 0) {
        device->sink(device->context, transfer->buffer, (size_t)transfer->actual_length);
    }
    if (transfer->status == LIBUSB_TRANSFER_COMPLETED && !device->ending) {
        if (device->settings.transfers > 0) {
            device->idle++;
        } else {
            device_submit(device, transfer);
        }
    } else if (transfer->status == LIBUSB_TRANSFER_NO_DEVICE) {
        device->error = WHISKER_ERROR_DEVICE_GONE;
    } else if (transfer->status != LIBUSB_TRANSFER_CANCELLED && transfer->status != LIBUSB_TRANSFER_COMPLETED) {
        device->error = WHISKER_ERROR_DEVICE_USB;
    }
}

static int device_make_transfers(struct whisker_device *device)
{
    for (int i = 0; i < TRANSFERS_MAX; i++) {
        device->transfer[i] = libusb_alloc_transfer(0);
        if (!device->transfer[i]) {
            return WHISKER_ERROR_MEMORY;
        }
    }
    return WHISKER_OK;
}

static int device_open_all(struct whisker_device *device, const char *serial, struct whisker_identity *identity)
{
    if (libusb_init(&device->usb) != 0) {
        device->usb = NULL;
        return WHISKER_ERROR_DEVICE_USB;
    }
    int error = discovery_open(device->usb, serial, &device->handle, &device->about);
    if (!error) {
        error = device_make_transfers(device);
    }
    if (error) {
        return error;
    }
    device->hid = control_open(device->about.path);
    return device_blame(device, device->hid ? control_identify(device->hid, identity) : WHISKER_ERROR_DEVICE_CONTROL);
}

int whisker_device_open(const char *serial, struct whisker_device **device, struct whisker_identity *identity)
{
    *device = NULL;
    *identity = (struct whisker_identity){0};
    struct whisker_device *opened = calloc(1, sizeof *opened);
    if (!opened) {
        return WHISKER_ERROR_MEMORY;
    }
    whisker_settings_default(&opened->settings);
    const int error = device_open_all(opened, serial, identity);
    if (error) {
        whisker_device_close(opened);
        return error;
    }
    *device = opened;
    return WHISKER_OK;
}

const struct whisker_device_info *whisker_device_about(const struct whisker_device *device)
{
    return &device->about;
}

static void device_handle_events(struct whisker_device *device, int timeout_ms)
{
    struct timeval timeout = {.tv_sec = timeout_ms / 1000, .tv_usec = timeout_ms % 1000 * 1000};
    libusb_handle_events_timeout_completed(device->usb, &timeout, NULL);
}

void whisker_device_flush(struct whisker_device *device)
{
    device->ending = true;
    /* Last first: were an earlier one cancelled before a later, data could still fill the later and overtake it. */
    for (int i = device->transfers - 1; i >= 0 && device->active > 0; i--) {
        libusb_cancel_transfer(device->transfer[i]);
    }
    while (device->active > 0) {
        device_handle_events(device, STALE_TIMEOUT_MS);
    }
}

void whisker_device_close(struct whisker_device *device)
{
    if (!device) {
        return;
    }
    whisker_device_flush(device);
    for (int i = 0; i < TRANSFERS_MAX; i++) {
        libusb_free_transfer(device->transfer[i]);
    }
    control_close(device->hid);
    if (device->handle) {
        libusb_release_interface(device->handle, WHISKER_LIMIT_USB_BULK_INTERFACE);
        libusb_close(device->handle);
    }
    if (device->usb) {
        libusb_exit(device->usb);
    }
    free(device);
}

static int device_stop(struct whisker_device *device)
{
    return control_run(device->hid, &device->settings, false) ? WHISKER_ERROR_DEVICE_CONTROL : WHISKER_OK;
}

/* A process that was killed leaves the bridge running and its FIFO full; one that stopped it may leave frames, too. */
static int device_discard_stale(struct whisker_device *device)
{
    bool running;
    int error = control_is_running(device->hid, &running);
    if (!error && running) {
        error = device_stop(device);
    }
    int got = 1;
    while (!error && got > 0) {
        libusb_bulk_transfer(device->handle, WHISKER_LIMIT_USB_BULK_IN, device->buffer, STALE_BYTES, &got,
                             STALE_TIMEOUT_MS);
    }
    return error;
}

static int device_queue_transfers(struct whisker_device *device)
{
    const int bytes = device->settings.batch * (int)WHISKER_FRAME_BYTES;
    const int most = QUEUED_BYTES / bytes, wanted = device->settings.transfers;
    device->idle = device->turn = 0;
    device->transfers = wanted > 0 && wanted < most ? wanted : most;
    for (int i = 0; i < device->transfers; i++) {
        libusb_fill_bulk_transfer(device->transfer[i], device->handle, WHISKER_LIMIT_USB_BULK_IN,
                                  device->buffer + (size_t)i * (size_t)bytes, bytes, device_on_transfer, device, 0);
        const int error = libusb_submit_transfer(device->transfer[i]);
        if (error) {
            return usb_error(error);
        }
        device->active++;
    }
    return WHISKER_OK;
}

int whisker_device_start(struct whisker_device *device, const struct whisker_settings *settings, whisker_sink sink,
                         void *context)
{
    int error = whisker_settings_check(settings, NULL, 0);
    if (!error) {
        error = device_blame(device, device_discard_stale(device));
    }
    if (error) {
        return error;
    }
    device->settings = *settings;
    device->sink = sink;
    device->context = context;
    device->error = WHISKER_OK;
    device->ending = false;
    error = device_queue_transfers(device);
    return error ? error : device_blame(device, control_run(device->hid, settings, true));
}

int whisker_device_poll(struct whisker_device *device, int timeout_ms)
{
    for (; device->idle > 0 && !device->error; device->idle--) {
        device_submit(device, device->transfer[device->turn]);
        device->turn = (device->turn + 1) % device->transfers;
    }
    device_handle_events(device, timeout_ms);
    return device->error;
}

int whisker_device_stop(struct whisker_device *device)
{
    return device_blame(device, device_stop(device));
}

int whisker_device_timing(struct whisker_device *device, struct whisker_timing *timing)
{
    return device_blame(device, control_timing(device->hid, timing));
}

int device_send_service(struct whisker_device *device, const struct whisker_service_order *order)
{
    return device_blame(device, control_service(device->hid, order));
}

int device_silence(struct whisker_device *device)
{
    return device_blame(device, device_discard_stale(device));
}

int device_send_flash(struct whisker_device *device, const uint8_t *report)
{
    return device_blame(device, control_send_flash(device->hid, report));
}

int device_flash(struct whisker_device *device, uint8_t *report)
{
    return device_blame(device, control_flash(device->hid, report));
}

int device_answers(struct whisker_device *device, uint8_t *report)
{
    return device_blame(device, control_answers(device->hid, report));
}
