/* Writes gateware images to a bridge's flash, an order of 32 bytes at a time. */
#include <string.h>

#include "crc32.h"
#include "device_service.h"
#include "whisker/errors.h"
#include "whisker/gateware.h"
#include "whisker_protocol.h"

bool whisker_gateware_is(const uint8_t *bytes, size_t count)
{
    return count >= sizeof(uint32_t) &&
           whisker_get_u32(bytes + WHISKER_GATEWARE_HEADER_MAGIC) == WHISKER_LIMIT_GATEWARE_MAGIC;
}

int whisker_gateware_parse(const uint8_t *bytes, size_t count, struct whisker_gateware *image)
{
    if (count < WHISKER_GATEWARE_HEADER_BYTES || !whisker_gateware_is(bytes, count)) {
        return WHISKER_ERROR_GATEWARE_IMAGE;
    }
    *image = (struct whisker_gateware){
        .header = bytes,
        .body = bytes + WHISKER_GATEWARE_HEADER_BYTES,
        .length = whisker_get_u32(bytes + WHISKER_GATEWARE_HEADER_LENGTH),
        .gateware = whisker_get_u16(bytes + WHISKER_GATEWARE_HEADER_GATEWARE),
        .build = whisker_get_u16(bytes + WHISKER_GATEWARE_HEADER_BUILD),
        .wire_version = bytes[WHISKER_GATEWARE_HEADER_WIRE_VERSION],
        .board = bytes[WHISKER_GATEWARE_HEADER_BOARD],
        .lanes = bytes[WHISKER_GATEWARE_HEADER_LANES],
    };
    const bool sound =
        bytes[WHISKER_GATEWARE_HEADER_FORMAT] == WHISKER_LIMIT_GATEWARE_FORMAT &&
        whisker_get_u32(bytes + WHISKER_GATEWARE_HEADER_HEADER_CRC32) ==
            crc32_of(bytes, WHISKER_GATEWARE_HEADER_HEADER_CRC32) &&
        image->length == count - WHISKER_GATEWARE_HEADER_BYTES && image->length > 0 &&
        whisker_get_u32(bytes + WHISKER_GATEWARE_HEADER_BODY_CRC32) == crc32_of(image->body, image->length);
    return sound ? WHISKER_OK : WHISKER_ERROR_GATEWARE_IMAGE;
}

int whisker_gateware_fits(const struct whisker_gateware *image, const struct whisker_identity *identity, bool older)
{
    return image->board != identity->board                  ? WHISKER_ERROR_GATEWARE_BOARD
           : image->lanes != identity->wired_lanes          ? WHISKER_ERROR_GATEWARE_LANES
           : image->wire_version != WHISKER_WIRE_VERSION    ? WHISKER_ERROR_WIRE_VERSION
           : image->gateware < identity->gateware && !older ? WHISKER_ERROR_GATEWARE_OLDER
                                                            : WHISKER_OK;
}

#define UNIT (WHISKER_REPORT_FLASH_BYTES - WHISKER_REPORT_FLASH_DATA)
#define SECTOR 4096u
#define PAGE 256u
#define ADDRESS_END (1u << 24) /* of three bytes of address */
#define POLLS_MAX 4000         /* of at least 0.25 ms each: an erase takes 0.4 s at most */
#define TRIES 3                /* of an order whose transfers failed */
#define ERASED 0xFF
#define PREAMBLE_BYTES 4
#define PREAMBLE_END 512u /* a bitstream's text before its preamble is shorter */
#define JUMP_OPCODE 0x7E
#define JUMP_ADDRESS 5 /* behind the opcode: three zeros, the speed, the address */

_Static_assert(WHISKER_GATEWARE_HEADER_BYTES == UNIT, "the header is written by one order");

static const uint8_t PREAMBLE[PREAMBLE_BYTES] = {0xFF, 0xFF, 0xBD, 0xB3}; /* of an ECP5's bitstream */

struct writing {
    struct whisker_device *device;
    const struct whisker_gateware *image;
    uint32_t writable, size; /* of the flash */
    uint32_t done;           /* bytes of the image */
    bool unmarked;           /* the flash holds no image that would be started or counts as whole */
    whisker_gateware_progress progress;
    void *context;
};

/* Waits until the flash is idle; `report` then holds the latest order and what came. */
static int gateware_await(struct whisker_device *device, uint8_t report[WHISKER_REPORT_FLASH_BYTES])
{
    int error = WHISKER_OK;
    report[WHISKER_REPORT_FLASH_BUSY] = 1;
    for (int i = 0; !error && report[WHISKER_REPORT_FLASH_BUSY]; i++) {
        error = i < POLLS_MAX ? device_flash(device, report) : WHISKER_ERROR_FLASH_BUSY;
    }
    return error;
}

/* Gives the flash an order and waits for its end. */
static int gateware_try(struct whisker_device *device, uint8_t command, uint32_t address, const uint8_t *data,
                        uint8_t report[WHISKER_REPORT_FLASH_BYTES])
{
    memset(report, 0, WHISKER_REPORT_FLASH_BYTES);
    report[0] = WHISKER_REPORT_ID_FLASH;
    report[WHISKER_REPORT_FLASH_WIRE_VERSION] = WHISKER_WIRE_VERSION;
    report[WHISKER_REPORT_FLASH_COMMAND] = command;
    whisker_put_u32(report + WHISKER_REPORT_FLASH_ADDRESS, address);
    memcpy(report + WHISKER_REPORT_FLASH_DATA, data, UNIT);
    const int error = device_send_flash(device, report);
    return error ? error : gateware_await(device, report);
}

/* The same; `data`, UNIT bytes, is what the flash writes, or what it read. An update takes 10^5 transfers. One of them
 * fails if the machine stands still for longer than hidapi waits, so a failed order is given again. An order that the
 * bridge has carried out changes nothing when it comes again. */
static int gateware_order(struct whisker_device *device, uint8_t command, uint32_t address, uint8_t *data)
{
    uint8_t report[WHISKER_REPORT_FLASH_BYTES];
    int error = gateware_try(device, command, address, data, report);
    for (int i = 1; i < TRIES && (error == WHISKER_ERROR_DEVICE_REFUSED || error == WHISKER_ERROR_DEVICE_CONTROL);
         i++) {
        error = gateware_await(device, report);
        error = error ? error : gateware_try(device, command, address, data, report);
    }
    if (!error) {
        memcpy(data, report + WHISKER_REPORT_FLASH_DATA, UNIT);
    }
    return error;
}

static int gateware_read_flash(struct whisker_device *device, uint32_t address, uint8_t *bytes, size_t count)
{
    int error = WHISKER_OK;
    for (size_t at = 0; !error && at < count; at += UNIT) {
        error = gateware_order(device, WHISKER_FLASH_COMMAND_READ, address + (uint32_t)at, bytes + at);
    }
    return error;
}

static int gateware_erase(struct whisker_device *device, uint32_t address)
{
    uint8_t nothing[UNIT] = {0};
    return gateware_order(device, WHISKER_FLASH_COMMAND_ERASE, address, nothing);
}

/* Makes an erased unit hold this, and reads it back. */
static int gateware_program(struct whisker_device *device, uint32_t address, const uint8_t *wanted)
{
    uint8_t data[UNIT], erased[UNIT];
    memset(erased, ERASED, UNIT);
    memcpy(data, wanted, UNIT);
    int error = WHISKER_OK;
    if (memcmp(wanted, erased, UNIT) != 0) {
        error = gateware_order(device, WHISKER_FLASH_COMMAND_PROGRAM, address, data);
    }
    if (!error) {
        error = gateware_order(device, WHISKER_FLASH_COMMAND_READ, address, data);
    }
    return error ? error : memcmp(data, wanted, UNIT) != 0 ? WHISKER_ERROR_FLASH_VERIFY : WHISKER_OK;
}

/* A flash's third byte of identity is the exponent of its size. */
static int gateware_find_size(struct writing *w)
{
    uint8_t identity[UNIT] = {0};
    const int error = gateware_order(w->device, WHISKER_FLASH_COMMAND_IDENTIFY, 0, identity);
    if (error) {
        return error;
    }
    const unsigned exponent = identity[2];
    const bool reported = identity[0] != 0 && identity[0] != ERASED && exponent >= 16 && exponent < 32;
    w->size = !reported ? 0 : exponent > 24 ? ADDRESS_END : UINT32_C(1) << exponent;
    return w->size > w->writable ? WHISKER_OK : WHISKER_ERROR_FLASH_CHIP;
}

static const uint8_t *gateware_find_preamble(const uint8_t *bytes, size_t count)
{
    for (size_t at = 0; at + PREAMBLE_BYTES <= count; at++) {
        if (!memcmp(bytes + at, PREAMBLE, PREAMBLE_BYTES)) {
            return bytes + at;
        }
    }
    return NULL;
}

/* The last page sends an FPGA that found no whole image to where the other begins. */
static bool gateware_jumps_to(const uint8_t page[PAGE], uint32_t address)
{
    const uint8_t *at = gateware_find_preamble(page, PAGE);
    const uint8_t wanted[] = {(uint8_t)(address >> 16), (uint8_t)(address >> 8), (uint8_t)address};
    for (; at && at + JUMP_ADDRESS + sizeof wanted <= page + PAGE; at++) {
        if (*at == JUMP_OPCODE && !memcmp(at + JUMP_ADDRESS, wanted, sizeof wanted)) {
            return true;
        }
    }
    return false;
}

static int gateware_find_fallback(struct writing *w)
{
    uint8_t start[PREAMBLE_END], page[PAGE];
    int error = gateware_read_flash(w->device, w->writable, start, sizeof start);
    if (!error) {
        error = gateware_read_flash(w->device, w->size - PAGE, page, sizeof page);
    }
    if (error) {
        return error;
    }
    const bool there = gateware_find_preamble(start, sizeof start) && gateware_jumps_to(page, w->writable);
    return there ? WHISKER_OK : WHISKER_ERROR_GATEWARE_FALLBACK;
}

static int gateware_check(struct writing *w)
{
    uint8_t report[WHISKER_REPORT_FLASH_BYTES];
    int error = device_silence(w->device);
    if (!error && device_flash(w->device, report)) {
        error = WHISKER_ERROR_GATEWARE_NO_FLASH; /* gateware before version 4 */
    }
    if (error) {
        return error;
    }
    w->writable = whisker_get_u32(report + WHISKER_REPORT_FLASH_WRITABLE);
    if (w->writable < SECTOR) {
        return WHISKER_ERROR_GATEWARE_NO_FLASH;
    }
    if (w->image->length > w->writable - SECTOR) {
        return WHISKER_ERROR_GATEWARE_SPACE;
    }
    error = gateware_find_size(w);
    return error ? error : gateware_find_fallback(w);
}

int whisker_gateware_check(struct whisker_device *device, const struct whisker_gateware *image)
{
    struct writing w = {.device = device, .image = image};
    return gateware_check(&w);
}

/* What a sector is to hold; behind the image's end it is erased. */
static void gateware_wanted_sector(const struct writing *w, uint32_t address, uint8_t wanted[SECTOR])
{
    const uint32_t left = w->image->length - address;
    memset(wanted, ERASED, SECTOR);
    memcpy(wanted, w->image->body + address, left < SECTOR ? left : SECTOR);
}

static void gateware_report(struct writing *w, uint32_t address)
{
    const uint32_t left = w->image->length - address;
    w->done += left < SECTOR ? left : SECTOR;
    if (w->progress) {
        w->progress(w->context, w->done, w->image->length);
    }
}

/* Before anything else is changed: without the first sector, which comes last, the FPGA starts the other image. */
static int gateware_unmark(struct writing *w)
{
    int error = WHISKER_OK;
    if (!w->unmarked) {
        error = gateware_erase(w->device, w->writable - SECTOR);
    }
    if (!error && !w->unmarked) {
        error = gateware_erase(w->device, 0);
    }
    w->unmarked = true;
    return error;
}

/* Writes a sector from its end to its beginning, so that the bitstream's preamble comes last of all. */
static int gateware_rewrite(struct writing *w, uint32_t address, const uint8_t wanted[SECTOR])
{
    int error = gateware_unmark(w);
    if (!error) {
        error = gateware_erase(w->device, address);
    }
    for (uint32_t at = SECTOR; !error && at > 0; at -= UNIT) {
        error = gateware_program(w->device, address + at - UNIT, wanted + at - UNIT);
    }
    return error;
}

/* 1: the flash holds this sector; 0: it does not; or an error. */
static int gateware_has_sector(struct writing *w, uint32_t address, const uint8_t wanted[SECTOR])
{
    uint8_t found[UNIT];
    for (uint32_t at = 0; at < SECTOR; at += UNIT) {
        const int error = gateware_read_flash(w->device, address + at, found, UNIT);
        if (error || memcmp(found, wanted + at, UNIT) != 0) {
            return error;
        }
    }
    return 1;
}

/* Makes a sector hold what it is to hold, unless it does. */
static int gateware_write_sector(struct writing *w, uint32_t address)
{
    uint8_t wanted[SECTOR];
    gateware_wanted_sector(w, address, wanted);
    const int has = gateware_has_sector(w, address, wanted);
    const int error = has == 0 ? gateware_rewrite(w, address, wanted) : has < 0 ? has : WHISKER_OK;
    if (!error) {
        gateware_report(w, address);
    }
    return error;
}

/* The header says that the image before it is whole. */
static int gateware_mark(struct writing *w)
{
    uint8_t found[UNIT];
    const uint32_t place = w->writable - SECTOR;
    int error = gateware_read_flash(w->device, place, found, UNIT);
    if (error || !memcmp(found, w->image->header, UNIT)) {
        return error;
    }
    error = gateware_erase(w->device, place);
    return error ? error : gateware_program(w->device, place, w->image->header);
}

int whisker_gateware_update(struct whisker_device *device, const struct whisker_gateware *image,
                            whisker_gateware_progress progress, void *context)
{
    struct writing w = {.device = device, .image = image, .progress = progress, .context = context};
    int error = gateware_check(&w);
    for (uint32_t address = SECTOR; !error && address < image->length; address += SECTOR) {
        error = gateware_write_sector(&w, address);
    }
    if (!error) {
        error = gateware_write_sector(&w, 0);
    }
    return error ? error : gateware_mark(&w);
}

int whisker_gateware_boot_drive(struct whisker_device *device)
{
    uint8_t report[WHISKER_REPORT_FLASH_BYTES] = {WHISKER_REPORT_ID_FLASH, WHISKER_WIRE_VERSION};
    report[WHISKER_REPORT_FLASH_COMMAND] = WHISKER_FLASH_COMMAND_BOOT;
    const int error = device_silence(device);
    return error ? error : device_send_flash(device, report);
}
