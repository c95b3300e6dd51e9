/* The HID side of a bridge: feature reports as structs. */
#ifndef WHISKER_CONTROL_H
#define WHISKER_CONTROL_H

#include <hidapi.h>
#include <stdbool.h>

#include "whisker/device.h"

/* Opens the HID interface of the first bridge. NULL: it is not there or may not be opened. */
hid_device *control_open(void);

/* Reads who the bridge is and compares. Returns 0, WIRE_VERSION, DEVICE_IDENTITY, DEVICE_CONTROL. */
int control_identify(hid_device *hid, struct whisker_identity *identity);

/* Sends the control report. Returns 0 or DEVICE_REFUSED. */
int control_run(hid_device *hid, const struct whisker_settings *settings, bool run);

/* Reads the counters. Returns 0 or DEVICE_CONTROL. */
int control_counters(hid_device *hid, struct whisker_counters *counters);

#endif
