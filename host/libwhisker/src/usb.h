/* What discovery, device and hot-plug share of libusb. */
#ifndef WHISKER_USB_H
#define WHISKER_USB_H

#include <libusb.h>
#include <stdbool.h>
#include <stdint.h>

#include "whisker/device.h"

/* The code of errors.h for one of libusb's. */
int usb_error(int error);

/* What a bridge's device descriptor holds. */
struct usb_identity {
    uint16_t vendor, product;
};

/* The numbers of $WHISKER_USB_ID ("1209:0001"), or, where it is not set, the protocol's. Returns 0, or
 * WHISKER_ERROR_USB_ID. */
int usb_read_identity(struct usb_identity *identity);

bool usb_is_bridge(libusb_device *candidate, const struct usb_identity *identity);

/* Speed of its bus in Mbit/s: 480, 12, or 0: another. */
uint16_t usb_mbit(libusb_device *device);

/* Fills in where it is plugged in. */
void usb_path(libusb_device *device, char *path, size_t n);

/* Reads the serial number of an open bridge; it is left empty when there is none. Returns 0 or a code. */
int usb_serial(libusb_device_handle *handle, char serial[WHISKER_SERIAL_BYTES]);

#endif
