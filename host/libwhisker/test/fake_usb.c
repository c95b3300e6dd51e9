#include "fake_usb.h"

#include <hidapi.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "whisker_protocol.h"

#define SERIAL_INDEX 3

struct fake_usb fake;

static struct libusb_transfer *queued[FAKE_TRANSFERS]; /* oldest first */
static bool cancelled[FAKE_TRANSFERS];
static struct completion {
    uint8_t bytes[4096];
    size_t count;
    enum libusb_transfer_status status;
} completions[FAKE_TRANSFERS], held;
static int completion_count;
static char object; /* whatever an opaque handle points at */
static char bus[4]; /* the devices */
static struct {
    libusb_hotplug_callback_fn call;
    void *context;
    bool due;
} watcher;

void fake_reset(void)
{
    fake = (struct fake_usb){
        .plugged = true, .bridges = 1, .has_hid = true, .identity_bytes = WHISKER_REPORT_IDENTITY_BYTES};
    fake.identity[WHISKER_REPORT_CONTROL_ID] = WHISKER_REPORT_ID_IDENTITY;
    fake.identity[WHISKER_REPORT_IDENTITY_WIRE_VERSION] = WHISKER_WIRE_VERSION;
    fake.identity[WHISKER_REPORT_IDENTITY_LANES] = WHISKER_LIMIT_LANES;
    whisker_put_u32(fake.identity + WHISKER_REPORT_IDENTITY_CLOCK_HZ, WHISKER_LIMIT_CLOCK_HZ);
    whisker_put_u16(fake.identity + WHISKER_REPORT_IDENTITY_FRAME_BYTES, WHISKER_FRAME_BYTES);
    memset(cancelled, 0, sizeof cancelled);
    completion_count = 0;
    held.count = 0;
    watcher.call = NULL;
}

void fake_plug(bool event)
{
    fake.plugged = true;
    watcher.due = event;
}

static void fill(struct completion *completion, const void *bytes, size_t count, enum libusb_transfer_status status)
{
    memcpy(completion->bytes, bytes, count);
    completion->count = count;
    completion->status = status;
}

void fake_complete(const void *bytes, size_t count, enum libusb_transfer_status status)
{
    fill(&completions[completion_count++], bytes, count, status);
}

void fake_hold(const void *bytes, size_t count)
{
    fill(&held, bytes, count, LIBUSB_TRANSFER_CANCELLED);
}

static void note(char event)
{
    const size_t length = strlen(fake.events);
    if (length + 1 < sizeof fake.events && (length == 0 || fake.events[length - 1] != event)) {
        fake.events[length] = event; /* repetitions are noted once */
    }
}

/* ------------------------------------------------------------------------------------------------------- libusb */

int libusb_init(libusb_context **context)
{
    *context = (libusb_context *)&object;
    fake.opened++;
    return 0;
}

void libusb_exit(libusb_context *context)
{
    (void)context;
    fake.opened--;
}

ssize_t libusb_get_device_list(libusb_context *context, libusb_device ***list)
{
    static libusb_device *devices[sizeof bus];
    (void)context;
    for (int i = 0; i < fake.bridges; i++) {
        devices[i] = (libusb_device *)&bus[i];
    }
    *list = devices;
    return fake.plugged ? fake.bridges : 0;
}

void libusb_free_device_list(libusb_device **list, int unreference)
{
    (void)list;
    (void)unreference;
}

int libusb_get_device_descriptor(libusb_device *device, struct libusb_device_descriptor *about)
{
    (void)device;
    memset(about, 0, sizeof *about);
    about->idVendor = fake.vendor ? fake.vendor : WHISKER_LIMIT_USB_VENDOR_ID;
    about->idProduct = fake.product ? fake.product : WHISKER_LIMIT_USB_PRODUCT_ID;
    about->iSerialNumber = SERIAL_INDEX;
    return 0;
}

int libusb_get_device_speed(libusb_device *device)
{
    (void)device;
    return fake.speed;
}

uint8_t libusb_get_bus_number(libusb_device *device)
{
    (void)device;
    return 1;
}

int libusb_get_port_numbers(libusb_device *device, uint8_t *ports, int room)
{
    (void)room;
    ports[0] = 2;
    ports[1] = (uint8_t)((char *)device - bus + 1);
    return 2;
}

libusb_device *libusb_get_device(libusb_device_handle *handle)
{
    return (libusb_device *)handle;
}

int libusb_get_string_descriptor_ascii(libusb_device_handle *handle, uint8_t index, unsigned char *text, int room)
{
    const char serial[] = {'0', '0', '0', (char)('1' + (fake.twins ? 0 : (char *)handle - bus)), '\0'};
    if (index != SERIAL_INDEX || room < (int)sizeof serial) {
        return LIBUSB_ERROR_INVALID_PARAM;
    }
    memcpy(text, serial, sizeof serial);
    return (int)sizeof serial - 1;
}

int libusb_control_transfer(libusb_device_handle *handle, uint8_t type, uint8_t request, uint16_t value, uint16_t index,
                            unsigned char *bytes, uint16_t count, unsigned timeout_ms)
{
    (void)handle, (void)value, (void)index, (void)timeout_ms;
    if (type != LIBUSB_ENDPOINT_IN || request != LIBUSB_REQUEST_GET_STATUS) {
        return LIBUSB_ERROR_PIPE;
    }
    memset(bytes, 0, count);
    return fake.gone ? LIBUSB_ERROR_NO_DEVICE : count;
}

int libusb_has_capability(uint32_t capability)
{
    return capability == LIBUSB_CAP_HAS_HOTPLUG;
}

int libusb_hotplug_register_callback(libusb_context *context, int events, int flags, int vendor, int product, int class,
                                     libusb_hotplug_callback_fn call, void *user_data,
                                     libusb_hotplug_callback_handle *handle)
{
    (void)context, (void)events, (void)vendor, (void)product, (void)class;
    watcher.call = call;
    watcher.context = user_data;
    watcher.due = flags == LIBUSB_HOTPLUG_ENUMERATE && fake.plugged;
    *handle = 1;
    fake.opened++;
    return 0;
}

void libusb_hotplug_deregister_callback(libusb_context *context, libusb_hotplug_callback_handle handle)
{
    (void)context;
    watcher.call = NULL;
    fake.opened -= handle;
}

int libusb_open(libusb_device *device, libusb_device_handle **handle)
{
    if (fake.open_error == 0) {
        *handle = (libusb_device_handle *)device;
        fake.opened++;
    }
    return fake.open_error;
}

void libusb_close(libusb_device_handle *handle)
{
    (void)handle;
    fake.opened--;
}

int libusb_claim_interface(libusb_device_handle *handle, int interface)
{
    fake.opened += fake.claim_error == 0;
    fake.claimed = (int)((char *)handle - bus);
    return interface == WHISKER_LIMIT_USB_BULK_INTERFACE ? fake.claim_error : LIBUSB_ERROR_NOT_FOUND;
}

int libusb_release_interface(libusb_device_handle *handle, int interface)
{
    (void)handle;
    (void)interface;
    fake.opened--;
    return 0;
}

struct libusb_transfer *libusb_alloc_transfer(int packets)
{
    (void)packets;
    fake.opened++;
    return calloc(1, sizeof(struct libusb_transfer));
}

void libusb_free_transfer(struct libusb_transfer *transfer)
{
    fake.opened -= transfer != NULL;
    free(transfer);
}

int libusb_submit_transfer(struct libusb_transfer *transfer)
{
    note('q');
    cancelled[fake.in_flight] = false;
    queued[fake.in_flight++] = transfer;
    return 0;
}

int libusb_cancel_transfer(struct libusb_transfer *transfer)
{
    for (int i = 0; i < fake.in_flight; i++) {
        if (queued[i] == transfer) {
            cancelled[i] = true;
            return 0;
        }
    }
    return LIBUSB_ERROR_NOT_FOUND;
}

/* Takes the oldest transfer out of the queue and ends it. */
static void end_oldest(const struct completion *completion)
{
    struct libusb_transfer *transfer = queued[0];
    fake.in_flight--;
    memmove(queued, queued + 1, (size_t)fake.in_flight * sizeof queued[0]);
    memmove(cancelled, cancelled + 1, (size_t)fake.in_flight * sizeof cancelled[0]);
    memcpy(transfer->buffer, completion->bytes, completion->count);
    transfer->actual_length = (int)completion->count;
    transfer->status = completion->status;
    transfer->callback(transfer);
}

int libusb_handle_events_timeout_completed(libusb_context *context, struct timeval *timeout, int *completed)
{
    (void)completed;
    const int64_t wait_us = (int64_t)timeout->tv_sec * 1000000 + timeout->tv_usec;
    fake.longest_wait_us = wait_us > fake.longest_wait_us ? wait_us : fake.longest_wait_us;
    if (watcher.call && watcher.due) {
        watcher.due = false;
        watcher.call(context, (libusb_device *)&bus[0], LIBUSB_HOTPLUG_EVENT_DEVICE_ARRIVED, watcher.context);
    }
    if (fake.pump) {
        fake.pump();
    }
    const int ready = completion_count;
    completion_count = 0;
    for (int i = 0; i < ready; i++) {
        end_oldest(&completions[i]);
    }
    while (fake.in_flight > 0 && cancelled[0]) {
        const struct completion end = held;
        held = (struct completion){.status = LIBUSB_TRANSFER_CANCELLED};
        end_oldest(&end);
    }
    return 0;
}

int libusb_bulk_transfer(libusb_device_handle *handle, unsigned char endpoint, unsigned char *bytes, int room,
                         int *count, unsigned timeout_ms)
{
    (void)handle;
    (void)endpoint;
    (void)timeout_ms;
    note('r');
    *count = fake.stale_reads > 0 ? room : 0;
    memset(bytes, 0xEE, (size_t)*count);
    return fake.stale_reads-- > 0 ? 0 : LIBUSB_ERROR_TIMEOUT;
}

/* ------------------------------------------------------------------------------------------------------- hidapi */

hid_device *hid_open_path(const char *path)
{
    const bool found = fake.has_hid && path[0] == '1';
    snprintf(fake.hid_path, sizeof fake.hid_path, "%s", path);
    fake.opened += found;
    return found ? (hid_device *)&object : NULL;
}

void hid_close(hid_device *device)
{
    (void)device;
    fake.opened--;
}

int hid_exit(void)
{
    fake.hid_exits++;
    return 0;
}

int hid_get_feature_report(hid_device *device, unsigned char *bytes, size_t room)
{
    (void)device;
    if (fake.gone) {
        return -1;
    }
    if (bytes[0] == WHISKER_REPORT_ID_IDENTITY) {
        memcpy(bytes, fake.identity, sizeof fake.identity);
        return fake.identity_bytes;
    }
    if (bytes[0] == WHISKER_REPORT_ID_TIMING) {
        memcpy(bytes + 1, fake.timing + 1, sizeof fake.timing - 1);
        return (int)room;
    }
    bytes[WHISKER_REPORT_COUNTERS_RUNNING] = fake.running;
    return (int)room;
}

int hid_send_feature_report(hid_device *device, const unsigned char *bytes, size_t count)
{
    (void)device;
    if (fake.hid_refuses || fake.gone || count != sizeof fake.control) {
        return -1;
    }
    memcpy(fake.control, bytes, count);
    note(bytes[WHISKER_REPORT_CONTROL_RUN] ? 'S' : 'X');
    return (int)count;
}
