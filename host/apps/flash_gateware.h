/* whisker-flash with a gateware image: the bridge itself is what it is written to. */
#ifndef WHISKER_FLASH_GATEWARE_H
#define WHISKER_FLASH_GATEWARE_H

#include <stdbool.h>
#include <stdint.h>

/* A bar on standard error, if that is a terminal. */
void flash_show_progress(void *context, uint32_t done, uint32_t total);

/* Loads the image file's bytes into the bridge of this serial number (NULL: the first). Prints what was done, or one
 * line why not; returns an exit code. */
int flash_gateware(const char *path, const uint8_t *bytes, uint32_t count, const char *bridge, bool force,
                   bool dry_run);

/* Asks the bridge of this serial number (NULL: the first) into its boot drive; a line if it has none; an exit code. */
int flash_boot_drive(const char *bridge);

#endif
