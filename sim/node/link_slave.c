#include "link_slave.h"

#include <string.h>

void link_slave_reset(struct link_slave *slave)
{
    memset(slave, 0, sizeof *slave);
    slave->miso = true;
}

static void load(struct link_slave *slave)
{
    slave->out = slave->words[slave->word < LINK_WORDS ? slave->word : LINK_WORDS - 1u];
    slave->bit = 0;
}

void link_slave_arm(struct link_slave *slave, const uint16_t *words)
{
    slave->words = words;
    slave->word = 0;
    load(slave);
}

void link_slave_select(struct link_slave *slave, bool low)
{
    slave->selected = low;
    slave->miso = true;
    load(slave);
}

static bool end_word(struct link_slave *slave)
{
    const bool counted = slave->word < LINK_WORDS;
    if (counted)
        slave->received[slave->word++] = slave->in;
    load(slave);
    return counted && slave->word == LINK_WORDS;
}

bool link_slave_sck(struct link_slave *slave, bool level, bool mosi)
{
    if (level == slave->sck)
        return false;
    slave->sck = level;
    if (!slave->selected)
        return false;
    if (level) {
        slave->miso = (slave->out & 0x8000u) != 0;
        slave->out = (uint16_t)(slave->out << 1);
        return false;
    }
    slave->in = (uint16_t)(slave->in << 1 | mosi);
    return ++slave->bit == 16u && end_word(slave);
}
