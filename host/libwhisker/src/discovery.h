/* Finding bridges on the bus. */
#ifndef WHISKER_DISCOVERY_H
#define WHISKER_DISCOVERY_H

#include "usb.h"

/*
 * Opens the bridge of this serial number (NULL: the first that lets itself be opened) and claims its bulk interface.
 * Returns 0, the handle and what is known of it, or a code; with NULL that of the first bridge that refused.
 */
int discovery_open(libusb_context *usb, const char *serial, libusb_device_handle **handle,
                   struct whisker_device_info *about);

/* Is a bridge plugged in now? Looks with a context of its own: an old one hears only what udev announces. */
bool discovery_present(void);

#endif
