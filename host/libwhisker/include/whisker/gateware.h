/*
 * Gateware updates over USB: an image file's bytes, whether they are for this bridge, and writing them to its flash.
 *
 * The flash holds two images. The FPGA starts the first, at address 0, which is the one that is written here; if that
 * is not whole, it starts the other, which the bridge itself refuses to change. The first bytes of the first image are
 * erased first and written last, so at no moment is there a part of an image that would be started.
 *
 * Threads and errors: as in device.h. Nothing here allocates.
 */
#ifndef WHISKER_GATEWARE_H
#define WHISKER_GATEWARE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "whisker/device.h"

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

/* An image file's bytes, checked. */
struct whisker_gateware {
    const uint8_t *header; /* 32 bytes */
    const uint8_t *body;
    uint32_t length; /* of the body */
    uint16_t gateware, build;
    uint8_t wire_version, board, lanes;
};

/* Whether a file begins as a gateware image does, sound or not. */
bool whisker_gateware_is(const uint8_t *bytes, size_t count);

/* Takes an image file apart. Returns 0, or GATEWARE_IMAGE: it is not one, or damaged. `bytes` must outlive the image.
 */
int whisker_gateware_parse(const uint8_t *bytes, size_t count, struct whisker_gateware *image);

/* Is the image for this bridge? older: also one of an older version. Returns 0, GATEWARE_BOARD, GATEWARE_LANES,
 * WIRE_VERSION, GATEWARE_OLDER. */
int whisker_gateware_fits(const struct whisker_gateware *image, const struct whisker_identity *identity, bool older);

/* Can the bridge's flash take it? Stops a run. Returns 0, GATEWARE_NO_FLASH, GATEWARE_SPACE, FLASH_CHIP,
 * GATEWARE_FALLBACK, FLASH_BUSY, DEVICE_CONTROL, DEVICE_GONE. */
int whisker_gateware_check(struct whisker_device *device, const struct whisker_gateware *image);

/* Called with the bytes that are in the flash, of `total`. */
typedef void (*whisker_gateware_progress)(void *context, uint32_t bytes, uint32_t total);

/*
 * Checks as whisker_gateware_check, then writes the image, reads every byte back, and marks it whole. What the flash
 * holds already is left as it is, so that an update that was interrupted goes on where it was. The bridge goes on with
 * the gateware it runs until its power is taken away. Returns as whisker_gateware_check, or FLASH_VERIFY.
 */
int whisker_gateware_update(struct whisker_device *device, const struct whisker_gateware *image,
                            whisker_gateware_progress progress, void *context);

/* Asks a board that takes its firmware as a drive (the Pico) to begin anew as one; it leaves the bus. Stops a run.
 * Returns 0, DEVICE_REFUSED (no such board), DEVICE_CONTROL, DEVICE_GONE. */
int whisker_gateware_boot_drive(struct whisker_device *device);
#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif
