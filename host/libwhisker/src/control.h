/* The HID side of a bridge: feature reports as structs. */
#ifndef WHISKER_CONTROL_H
#define WHISKER_CONTROL_H

#include <hidapi.h>
#include <stdbool.h>

#include "whisker/device.h"
#include "whisker/service.h"

/* Opens the HID interface of the bridge that is plugged in at this place. NULL: not there, or it may not be opened. */
hid_device *control_open(const char *path);

/* Closes it; NULL is allowed. hidapi has one state for all its handles: it goes with the last of them. */
void control_close(hid_device *hid);

/* The identity report's bytes as a struct, and compared with what this host knows. Returns 0, WIRE_VERSION,
 * DEVICE_IDENTITY. */
int control_parse_identity(const uint8_t *bytes, struct whisker_identity *identity);

/* Reads who the bridge is and compares. Returns 0, WIRE_VERSION, DEVICE_IDENTITY, DEVICE_CONTROL. */
int control_identify(hid_device *hid, struct whisker_identity *identity);

/* Sends the control report. Returns 0 or DEVICE_REFUSED. */
int control_run(hid_device *hid, const struct whisker_settings *settings, bool run);

/* Hands the bridge a service order. Returns 0 or DEVICE_REFUSED. */
int control_service(hid_device *hid, const struct whisker_service_order *order);

/* Reads the report `answers`: WHISKER_REPORT_ANSWERS_BYTES bytes. Returns 0 or DEVICE_CONTROL. */
int control_answers(hid_device *hid, uint8_t *report);

/* Hands the bridge an order to its flash, WHISKER_REPORT_FLASH_BYTES bytes. Returns 0 or DEVICE_REFUSED. */
int control_send_flash(hid_device *hid, const uint8_t *report);

/* Reads the report `flash`. Returns 0 or DEVICE_CONTROL. */
int control_flash(hid_device *hid, uint8_t *report);

/* Reads the report `timing`. Returns 0 or DEVICE_CONTROL. */
int control_timing(hid_device *hid, struct whisker_timing *timing);

/* Whether the bridge runs, by the report `counters`. Returns 0 or DEVICE_CONTROL. */
int control_is_running(hid_device *hid, bool *running);

#endif
