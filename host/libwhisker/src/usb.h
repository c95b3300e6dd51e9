/* What discovery, device and hot-plug share of libusb. */
#ifndef WHISKER_USB_H
#define WHISKER_USB_H

#include <libusb.h>
#include <stdbool.h>

#include "whisker/device.h"

/* The code of errors.h for one of libusb's. */
int usb_error(int error);

/* Does it have the bridge's vendor and product numbers? */
bool usb_is_bridge(libusb_device *candidate);

/* Fills in where it is plugged in. */
void usb_path(libusb_device *device, char *path, size_t n);

/* Reads the serial number of an open bridge; it is left empty when there is none. Returns 0 or a code. */
int usb_serial(libusb_device_handle *handle, char serial[WHISKER_SERIAL_BYTES]);

#endif
