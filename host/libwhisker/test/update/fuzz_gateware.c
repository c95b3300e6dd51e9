/*
 * libFuzzer target: whatever a file holds, it is refused or is a gateware image whose every part lies within it; and
 * whatever a flash says, an update ends, and writes nothing beyond what may be written. Input: the file; then taken
 * again as what the flash answers, but for where its first byte wants what lets an update go on.
 */
#include <stdlib.h>
#include <string.h>

#include "device_service.h"
#include "gateware_bytes.h"
#include "whisker/errors.h"
#include "whisker/gateware.h"
#include "whisker_protocol.h"

#define WRITABLE 0x10000u
#define JUMP ((1u << 20) - 256u)
#define DATA WHISKER_REPORT_FLASH_DATA

static const uint8_t *left;
static size_t left_bytes;
static bool has_fallback, keeps; /* the flash has an image to fall back to; it holds what was written last */
static uint8_t latest[WHISKER_REPORT_FLASH_BYTES], programmed[WHISKER_REPORT_FLASH_BYTES];

static void require(bool holds)
{
    if (!holds) {
        abort();
    }
}

int device_silence(struct whisker_device *device)
{
    (void)device;
    return WHISKER_OK;
}

int device_send_flash(struct whisker_device *device, const uint8_t *report)
{
    (void)device;
    const uint8_t command = report[WHISKER_REPORT_FLASH_COMMAND];
    const bool writes = command == WHISKER_FLASH_COMMAND_ERASE || command == WHISKER_FLASH_COMMAND_PROGRAM;
    require(!writes || whisker_get_u32(report + WHISKER_REPORT_FLASH_ADDRESS) < WRITABLE);
    memcpy(latest, report, sizeof latest);
    if (command == WHISKER_FLASH_COMMAND_PROGRAM) {
        memcpy(programmed, report, sizeof programmed);
    }
    return WHISKER_OK;
}

static void answer_as_wanted(uint8_t *report)
{
    static const uint8_t JUMP_PAGE[32] = {0xFF, 0xFF, 0xBD, 0xB3, 0x7E, 0, 0, 0, 3, WRITABLE >> 16};
    static const uint8_t IDENTITY[32] = {0xEF, 0x40, 20};
    const uint32_t address = whisker_get_u32(latest + WHISKER_REPORT_FLASH_ADDRESS);
    if (has_fallback && latest[WHISKER_REPORT_FLASH_COMMAND] == WHISKER_FLASH_COMMAND_IDENTIFY) {
        memcpy(report + DATA, IDENTITY, sizeof IDENTITY);
    } else if (has_fallback && (address == WRITABLE || address == JUMP)) {
        memcpy(report + DATA, JUMP_PAGE, sizeof JUMP_PAGE);
    } else if (keeps && address == whisker_get_u32(programmed + WHISKER_REPORT_FLASH_ADDRESS)) {
        memcpy(report + DATA, programmed + DATA, sizeof programmed - DATA);
    }
}

/* With nothing left the bridge is gone. */
int device_flash(struct whisker_device *device, uint8_t *report)
{
    (void)device;
    memset(report, 0, WHISKER_REPORT_FLASH_BYTES);
    whisker_put_u32(report + WHISKER_REPORT_FLASH_WRITABLE, WRITABLE);
    const size_t count = left_bytes < 32 ? left_bytes : 32;
    memcpy(report + DATA, left, count);
    answer_as_wanted(report);
    left += keeps && count > 0 ? 1 : count; /* an image takes many orders */
    left_bytes -= keeps && count > 0 ? 1 : count;
    return count ? WHISKER_OK : WHISKER_ERROR_DEVICE_GONE;
}

static void check_parts(const uint8_t *bytes, size_t count, const struct whisker_gateware *image)
{
    require(image->header == bytes && image->body == bytes + WHISKER_GATEWARE_HEADER_BYTES);
    require(image->length == count - WHISKER_GATEWARE_HEADER_BYTES && image->length > 0);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct whisker_gateware image;
    uint8_t *bytes = malloc(size + 1); /* as long as the file, for the sanitizer to see */
    require(bytes != NULL);
    memcpy(bytes, data, size);
    if (whisker_gateware_parse(bytes, size, &image) == WHISKER_OK) {
        check_parts(bytes, size, &image);
    }
    if (size > WHISKER_GATEWARE_HEADER_BYTES) {
        gateware_seal(bytes, size);
        require(whisker_gateware_parse(bytes, size, &image) == WHISKER_OK);
        check_parts(bytes, size, &image);
        has_fallback = data[0] & 1u;
        keeps = data[0] & 2u;
        memset(programmed, 0xFF, sizeof programmed);
        left = data;
        left_bytes = size;
        (void)whisker_gateware_update(NULL, &image, NULL, NULL);
    }
    free(bytes);
    return 0;
}
