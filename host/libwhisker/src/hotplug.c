#include <stdlib.h>
#include <time.h>

#include "discovery.h"
#include "whisker/errors.h"
#include "whisker_protocol.h"

/* How often it is looked where no event comes, and how often a bridge that refused is tried again. */
#define LOOK_MS 1000

struct whisker_hotplug {
    libusb_context *usb;
    libusb_hotplug_callback_handle callback;
    bool watching; /* libusb announces arrivals */
    bool arrived;
    int64_t look_at_ms;
};

static int64_t hotplug_now_ms(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000 + now.tv_nsec / 1000000;
}

static int LIBUSB_CALL hotplug_on_arrival(libusb_context *usb, libusb_device *device, libusb_hotplug_event event,
                                          void *context)
{
    struct whisker_hotplug *hotplug = context;
    (void)usb;
    (void)device;
    (void)event;
    hotplug->arrived = true;
    return 0; /* go on watching */
}

int whisker_hotplug_open(struct whisker_hotplug **hotplug)
{
    struct usb_identity identity;
    *hotplug = NULL;
    const int unknown = usb_read_identity(&identity);
    if (unknown) {
        return unknown;
    }
    struct whisker_hotplug *made = calloc(1, sizeof *made);
    if (!made) {
        return WHISKER_ERROR_MEMORY;
    }
    if (libusb_init(&made->usb) != 0) {
        free(made);
        return WHISKER_ERROR_DEVICE_USB;
    }
    made->watching =
        libusb_has_capability(LIBUSB_CAP_HAS_HOTPLUG) &&
        libusb_hotplug_register_callback(made->usb, LIBUSB_HOTPLUG_EVENT_DEVICE_ARRIVED, LIBUSB_HOTPLUG_ENUMERATE,
                                         identity.vendor, identity.product, LIBUSB_HOTPLUG_MATCH_ANY,
                                         hotplug_on_arrival, made, &made->callback) == LIBUSB_SUCCESS;
    *hotplug = made;
    return WHISKER_OK;
}

/* Handles libusb's events, or waits for it up to wait_ms. False: a signal came. */
static bool hotplug_listen(struct whisker_hotplug *hotplug, int64_t wait_ms)
{
    struct timeval timeout = {.tv_sec = wait_ms / 1000, .tv_usec = wait_ms % 1000 * 1000};
    return libusb_handle_events_timeout_completed(hotplug->usb, &timeout, NULL) != LIBUSB_ERROR_INTERRUPTED;
}

/* Whether to try now: an arrival was reported, or it is time to look and one is there. */
static bool hotplug_try_now(struct whisker_hotplug *hotplug)
{
    const bool arrived = hotplug->arrived;
    if (!arrived && hotplug_now_ms() < hotplug->look_at_ms) {
        return false;
    }
    hotplug->arrived = false;
    hotplug->look_at_ms = hotplug_now_ms() + LOOK_MS;
    return arrived || discovery_present();
}

int whisker_hotplug_wait(struct whisker_hotplug *hotplug, int timeout_ms)
{
    const int64_t end_ms = hotplug_now_ms() + timeout_ms;
    bool undisturbed = hotplug_listen(hotplug, 0);
    while (!hotplug_try_now(hotplug)) {
        const int64_t until_ms = end_ms < hotplug->look_at_ms ? end_ms : hotplug->look_at_ms;
        const int64_t left_ms = until_ms - hotplug_now_ms();
        if (!undisturbed || hotplug_now_ms() >= end_ms) {
            return WHISKER_ERROR_TIMEOUT;
        }
        undisturbed = hotplug_listen(hotplug, left_ms > 0 ? left_ms : 0);
    }
    return WHISKER_OK;
}

void whisker_hotplug_close(struct whisker_hotplug *hotplug)
{
    if (hotplug) {
        if (hotplug->watching) {
            libusb_hotplug_deregister_callback(hotplug->usb, hotplug->callback);
        }
        libusb_exit(hotplug->usb);
        free(hotplug);
    }
}
