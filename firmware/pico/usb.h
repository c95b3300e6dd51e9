/* The USB device: full speed, endpoint 0, bulk IN 1 with frames, interrupt IN 2, which has nothing to say. */
#ifndef USB_H
#define USB_H

#include <stdbool.h>
#include <stdint.h>

/* Connects to the bus. `number`: the serial number, shown in 16 hexadecimal digits. */
void usb_start(uint64_t number);

/* The controller's interrupt. */
void usb_on_interrupt(void);

/* Frames may have come: sends, if the endpoint is free. With interrupts off, or in the controller's. */
void usb_stream(void);

/* Has a host configured the device, and is the bus awake? */
bool usb_is_in_use(void);

/* The host has ordered the boot drive: true once the order is confirmed to it. */
bool usb_wants_boot_drive(void);

#endif
