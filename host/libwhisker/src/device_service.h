/* The service reports of an open device. */
#ifndef WHISKER_DEVICE_SERVICE_H
#define WHISKER_DEVICE_SERVICE_H

#include "whisker/service.h"

/* Hands the bridge an order. Returns 0, DEVICE_REFUSED, DEVICE_GONE. */
int device_send_service(struct whisker_device *device, const struct whisker_service_order *order);

/* Reads the report `answers`. Returns 0, DEVICE_CONTROL, DEVICE_GONE. */
int device_answers(struct whisker_device *device, uint8_t *report);

/* Ends a run that a process left behind. Returns 0, DEVICE_CONTROL, DEVICE_GONE. */
int device_silence(struct whisker_device *device);

/* Hands the bridge an order to its flash, WHISKER_REPORT_FLASH_BYTES bytes. Returns 0, DEVICE_REFUSED, DEVICE_GONE. */
int device_send_flash(struct whisker_device *device, const uint8_t *report);

/* Reads the report `flash`. Returns 0, DEVICE_CONTROL, DEVICE_GONE. */
int device_flash(struct whisker_device *device, uint8_t *report);

#endif
