/* The image's application and loader: what a new node holds, and what an update brings. */
#include <string.h>

#include "image_port.h"
#include "sim_node_state.h"
#include "update_bench.h"

void sim_node_program_default(struct sim_node *node)
{
    memcpy(dspic_flash(node->chip), image_port_table()->flash, sizeof image_port_table()->flash);
}

void sim_update_body_fill(uint8_t body[UPDATE_BODY], uint16_t version)
{
    const uint32_t *word = image_port_table()->flash + (WHISKER_LIMIT_APPLICATION_ROW + 1u) * FLASH_ROW_WORDS;
    (void)version;
    for (uint32_t i = 0; i < UPDATE_BODY; i++)
        body[i] = (uint8_t)(word[i / 3u] >> 8u * (i % 3u) & 0xFFu);
}
