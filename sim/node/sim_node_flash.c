/* What is in a node's flash: the image it was programmed with, and what an update has made of it. */
#include "sim_node_state.h"

void sim_node_program(sim_node *node, const uint8_t *image, size_t bytes)
{
    uint32_t *word = dspic_flash(node->chip) + WHISKER_LIMIT_APPLICATION_ROW * FLASH_ROW_WORDS;
    for (uint32_t i = 0; i < FLASH_WORDS - WHISKER_LIMIT_APPLICATION_ROW * FLASH_ROW_WORDS; i++)
        word[i] = UINT32_C(0xFFFFFF);
    for (size_t i = 0; i < bytes; i++) { /* the body begins with the row after the header's */
        const size_t at =
            i < WHISKER_IMAGE_HEADER_BYTES ? i : i - WHISKER_IMAGE_HEADER_BYTES + WHISKER_LIMIT_FLASH_ROW_BYTES;
        word[at / 3u] &= ~(UINT32_C(0xFF) << 8u * (at % 3u)) | (uint32_t)image[i] << 8u * (at % 3u);
    }
}

uint16_t sim_node_blocks(const sim_node *node)
{
    return node->board.loading ? node->board.loader.next : 0u;
}

uint16_t sim_node_version(const sim_node *node)
{
    const uint32_t *word = dspic_flash(node->chip) + WHISKER_LIMIT_APPLICATION_ROW * FLASH_ROW_WORDS;
    uint8_t header[WHISKER_IMAGE_HEADER_BYTES];
    for (size_t i = 0; i < sizeof header; i++)
        header[i] = (uint8_t)(word[i / 3u] >> 8u * (i % 3u) & 0xFFu);
    return node->board.loading ? 0u : whisker_get_u16(header + WHISKER_IMAGE_HEADER_VERSION);
}
