/* Gateware images as files: what they say, and which bridge they are for. */
#include "crc32.h"
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
