/* The application that a new node holds: a header that the loader believes, and a row of nothing. */
#include <string.h>

#include "crc32.h"
#include "sim_node_state.h"

void sim_node_program_default(struct sim_node *node)
{
    uint8_t image[WHISKER_IMAGE_HEADER_BYTES + WHISKER_LIMIT_FLASH_ROW_BYTES];
    memset(image, 0, sizeof image);
    whisker_put_u32(image + WHISKER_IMAGE_HEADER_MAGIC, WHISKER_LIMIT_IMAGE_MAGIC);
    whisker_put_u16(image + WHISKER_IMAGE_HEADER_CHIP, node->parameters.chip.device_id);
    image[WHISKER_IMAGE_HEADER_WIRE_VERSION] = WHISKER_WIRE_VERSION;
    image[WHISKER_IMAGE_HEADER_FORMAT] = WHISKER_LIMIT_IMAGE_FORMAT;
    whisker_put_u32(image + WHISKER_IMAGE_HEADER_LENGTH, WHISKER_LIMIT_FLASH_ROW_BYTES);
    whisker_put_u32(image + WHISKER_IMAGE_HEADER_BODY_CRC32,
                    crc32_of(WHISKER_CRC32_INIT, image + WHISKER_IMAGE_HEADER_BYTES, WHISKER_LIMIT_FLASH_ROW_BYTES) ^
                        WHISKER_CRC32_XOR_OUT);
    whisker_put_u16(image + WHISKER_IMAGE_HEADER_VERSION, SIM_NODE_VERSION);
    whisker_put_u16(image + WHISKER_IMAGE_HEADER_FIRST_ROW, WHISKER_LIMIT_APPLICATION_ROW + 1u);
    whisker_put_u32(image + WHISKER_IMAGE_HEADER_HEADER_CRC32,
                    crc32_of(WHISKER_CRC32_INIT, image, WHISKER_IMAGE_HEADER_HEADER_CRC32) ^ WHISKER_CRC32_XOR_OUT);
    sim_node_program(node, image, sizeof image);
}
