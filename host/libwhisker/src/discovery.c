#include "discovery.h"

#include <string.h>

#include "whisker/errors.h"
#include "whisker_protocol.h"

static struct whisker_device_info discovery_describe(libusb_device *found)
{
    struct whisker_device_info about = {.usb_mbit = usb_mbit(found)};
    libusb_device_handle *handle;
    usb_path(found, about.path, sizeof about.path);
    const int opened = libusb_open(found, &handle);
    if (opened != 0) {
        about.error = usb_error(opened);
        return about;
    }
    about.error = usb_serial(handle, about.serial);
    libusb_close(handle);
    return about;
}

/* Fills in up to `room` of the bridges that `usb` knows; returns how many it knows, or a code. */
static int discovery_list_bridges(libusb_context *usb, struct whisker_device_info *list, int room)
{
    libusb_device **all;
    struct usb_identity identity;
    const int unknown = usb_read_identity(&identity);
    if (unknown) {
        return unknown;
    }
    const ssize_t count = libusb_get_device_list(usb, &all);
    if (count < 0) {
        return usb_error((int)count);
    }
    int bridges = 0;
    for (ssize_t i = 0; i < count; i++) {
        if (usb_is_bridge(all[i], &identity)) {
            if (bridges < room) {
                list[bridges] = discovery_describe(all[i]);
            }
            bridges++;
        }
    }
    libusb_free_device_list(all, 1);
    return bridges;
}

int whisker_device_list(struct whisker_device_info *list, int room)
{
    libusb_context *usb;
    if (libusb_init(&usb) != 0) {
        return WHISKER_ERROR_DEVICE_USB;
    }
    const int bridges = discovery_list_bridges(usb, list, room);
    libusb_exit(usb);
    return bridges;
}

bool discovery_present(void)
{
    return whisker_device_list(NULL, 0) > 0;
}

static int discovery_try_open(libusb_device *found, const char *serial, libusb_device_handle **handle,
                              struct whisker_device_info *about)
{
    *about = (struct whisker_device_info){.usb_mbit = usb_mbit(found)};
    usb_path(found, about->path, sizeof about->path);
    const int opened = libusb_open(found, handle);
    if (opened != 0) {
        return usb_error(opened);
    }
    int error = usb_serial(*handle, about->serial);
    if (!error && serial && strcmp(serial, about->serial) != 0) {
        error = WHISKER_ERROR_DEVICE_SERIAL;
    }
    if (!error) {
        const int claimed = libusb_claim_interface(*handle, WHISKER_LIMIT_USB_BULK_INTERFACE);
        error = claimed ? usb_error(claimed) : WHISKER_OK;
    }
    if (error) {
        libusb_close(*handle);
        *handle = NULL;
    }
    return error;
}

/* What a person must know first: a bridge that refuses says more than another one that is not the one wanted. */
static int discovery_more_reporting(int before, int now)
{
    return before == WHISKER_ERROR_DEVICE_MISSING || before == WHISKER_ERROR_DEVICE_SERIAL ? now : before;
}

/* How many bridges say this serial number, as far as they may be asked. */
static int discovery_count(libusb_device *const *all, ssize_t count, const struct usb_identity *identity,
                           const char *serial)
{
    int found = 0;
    for (ssize_t i = 0; i < count; i++) {
        found += usb_is_bridge(all[i], identity) && strcmp(discovery_describe(all[i]).serial, serial) == 0;
    }
    return found;
}

int discovery_open(libusb_context *usb, const char *serial, libusb_device_handle **handle,
                   struct whisker_device_info *about)
{
    libusb_device **all;
    struct usb_identity identity;
    *handle = NULL;
    const int unknown = usb_read_identity(&identity);
    if (unknown) {
        return unknown;
    }
    const ssize_t count = libusb_get_device_list(usb, &all);
    if (count < 0) {
        return usb_error((int)count);
    }
    const bool is_told_apart = !serial || discovery_count(all, count, &identity, serial) < 2;
    int error = is_told_apart ? WHISKER_ERROR_DEVICE_MISSING : WHISKER_ERROR_DEVICE_TWINS;
    for (ssize_t i = 0; i < count && !*handle && is_told_apart; i++) {
        if (usb_is_bridge(all[i], &identity)) {
            error = discovery_more_reporting(error, discovery_try_open(all[i], serial, handle, about));
        }
    }
    libusb_free_device_list(all, 1);
    if (*handle) {
        return WHISKER_OK;
    }
    return serial && error == WHISKER_ERROR_DEVICE_MISSING ? WHISKER_ERROR_DEVICE_SERIAL : error;
}
