/* HID feature reports: what the host reads and writes besides frames. */
#ifndef REPORTS_H
#define REPORTS_H

#include <stdbool.h>
#include <stdint.h>

#define REPORTS_BYTES_MAX 176u
#define REPORTS_WRITTEN_MAX 56u

/* Fills in a report that the host reads; its length, 0: there is none of that id. */
uint32_t reports_get(uint8_t id, uint8_t bytes[REPORTS_BYTES_MAX]);

/* Length of a report that the host may write; 0: none of that id. */
uint32_t reports_writable(uint8_t id);

/* Takes a written report, whole; false: refused, and nothing has changed. */
bool reports_set(const uint8_t *bytes);

/* True once an order for the boot drive was taken. */
bool reports_want_boot_drive(void);

#endif
