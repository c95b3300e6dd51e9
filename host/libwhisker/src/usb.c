#include "usb.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "whisker/errors.h"
#include "whisker_protocol.h"

/* USB allows seven tiers. */
#define PORTS_MAX 7
#define HEXADECIMAL "0123456789abcdefABCDEF"

int usb_error(int error)
{
    switch (error) {
    case LIBUSB_ERROR_ACCESS:
        return WHISKER_ERROR_DEVICE_ACCESS;
    case LIBUSB_ERROR_BUSY:
        return WHISKER_ERROR_DEVICE_BUSY;
    case LIBUSB_ERROR_NO_DEVICE:
    case LIBUSB_ERROR_NOT_FOUND:
        return WHISKER_ERROR_DEVICE_GONE;
    case LIBUSB_ERROR_NO_MEM:
        return WHISKER_ERROR_MEMORY;
    default:
        return WHISKER_ERROR_DEVICE_USB;
    }
}

int usb_read_identity(struct usb_identity *identity)
{
    const char *text = getenv("WHISKER_USB_ID");
    *identity = (struct usb_identity){WHISKER_LIMIT_USB_VENDOR_ID, WHISKER_LIMIT_USB_PRODUCT_ID};
    if (!text) {
        return WHISKER_OK;
    }
    if (strlen(text) != 9 || text[4] != ':' || strspn(text, HEXADECIMAL) != 4 || strspn(text + 5, HEXADECIMAL) != 4) {
        return WHISKER_ERROR_USB_ID;
    }
    identity->vendor = (uint16_t)strtoul(text, NULL, 16);
    identity->product = (uint16_t)strtoul(text + 5, NULL, 16);
    return WHISKER_OK;
}

bool usb_is_bridge(libusb_device *candidate, const struct usb_identity *identity)
{
    struct libusb_device_descriptor about;
    return libusb_get_device_descriptor(candidate, &about) == 0 && about.idVendor == identity->vendor &&
           about.idProduct == identity->product;
}

uint16_t usb_mbit(libusb_device *device)
{
    const int speed = libusb_get_device_speed(device);
    return speed == LIBUSB_SPEED_HIGH ? 480 : speed == LIBUSB_SPEED_FULL ? 12 : 0;
}

void usb_path(libusb_device *device, char *path, size_t n)
{
    uint8_t port[PORTS_MAX];
    const int ports = libusb_get_port_numbers(device, port, PORTS_MAX);
    int length = snprintf(path, n, "%u", libusb_get_bus_number(device));
    for (int i = 0; i < ports && length > 0 && (size_t)length < n; i++) {
        length += snprintf(path + length, n - (size_t)length, "%c%u", i == 0 ? '-' : '.', port[i]);
    }
}

int usb_serial(libusb_device_handle *handle, char serial[WHISKER_SERIAL_BYTES])
{
    struct libusb_device_descriptor about;
    serial[0] = '\0';
    int got = libusb_get_device_descriptor(libusb_get_device(handle), &about);
    if (got == 0 && about.iSerialNumber != 0) {
        got = libusb_get_string_descriptor_ascii(handle, about.iSerialNumber, (unsigned char *)serial,
                                                 WHISKER_SERIAL_BYTES);
    }
    return got < 0 ? usb_error(got) : WHISKER_OK;
}
