/* When a tick was, by the start-of-frame packets of the host's USB controller. */
#ifndef WHISKER_CLOCK_USB_H
#define WHISKER_CLOCK_USB_H

#include "whisker/clock.h"

/* usb_time says something. */
bool clock_usb_known(uint16_t usb_time);

/* Begins anew with the next tick. */
void clock_usb_begin(struct whisker_clock_usb *usb, double nominal_ns);

/* The date of a frame's tick, ns. near_ns: about where it is, to a second. Cycles may go back: the bridge was started
 * again, and the controller's time goes on. */
double clock_usb_date(struct whisker_clock_usb *usb, uint64_t cycles, uint16_t usb_time, double near_ns);

/* A report gives a date exactly, and with the one before the rate. */
void clock_usb_report(struct whisker_clock_usb *usb, uint64_t cycles, uint16_t usb_time, uint16_t sof_cycles);

#endif
