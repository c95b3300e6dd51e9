/* Flash self-programming: holding buffers, page erase, row and word write; the CPU stalls meanwhile. */
#include "dspic_chip.h"

static uint32_t dspic_flash_program_word(const struct dspic *chip, uint16_t offset)
{
    return ((uint32_t)(chip->sfr[TBLPAG / 2u] & 0xFFu) << 16 | offset) / 2u;
}

/* What lies beyond the flash: device id and user identification. */
static uint32_t dspic_flash_special_word(const struct dspic *chip, uint32_t at)
{
    const uint32_t devid = ((uint32_t)DEVID_PAGE << 16 | DEVID_OFFSET) / 2u;
    const uint32_t fuid = ((uint32_t)CONFIG_PAGE << 16 | FUID0_OFFSET) / 2u;
    if (at == devid)
        return chip->parameters.device_id;
    return at >= fuid && at < fuid + 4u ? chip->parameters.serial >> 8u * (at - fuid) & 0xFFu : 0;
}

uint16_t dspic_table_read(struct dspic *chip, uint16_t offset, bool high)
{
    const uint32_t at = dspic_flash_program_word(chip, offset);
    const uint32_t word = at < FLASH_WORDS ? chip->flash[at] : dspic_flash_special_word(chip, at);
    dspic_spend(chip, 2u);
    return (uint16_t)(high ? word >> 16 : word);
}

void dspic_table_write(struct dspic *chip, uint16_t offset, bool high, uint16_t value)
{
    chip->target = dspic_flash_program_word(chip, offset);
    uint32_t *latch = &chip->latch[chip->target % FLASH_ROW_WORDS];
    *latch = high ? (*latch & 0xFFFFu) | (uint32_t)(value & 0xFFu) << 16 : (*latch & 0xFF0000u) | value;
    dspic_spend(chip, 2u);
}

static uint32_t dspic_flash_random_word(struct dspic *chip)
{
    chip->random ^= chip->random << 13;
    chip->random ^= chip->random >> 7;
    chip->random ^= chip->random << 17;
    return (uint32_t)(chip->random >> 20) & 0xFFFFFFu;
}

/* The part of an operation that was done before the supply failed: some words as meant, one in between, others old. */
static void dspic_flash_apply(struct dspic *chip, uint32_t first, unsigned words, bool erase, double done)
{
    const unsigned whole = (unsigned)(done * words);
    for (unsigned i = 0; i < words && i <= whole && first + i < FLASH_WORDS; i++) {
        uint32_t *word = &chip->flash[first + i];
        const uint32_t meant = erase ? 0xFFFFFFu : *word & chip->latch[(first + i) % FLASH_ROW_WORDS];
        if (i < whole || done >= 1.0)
            *word = meant;
        else
            *word = erase ? *word | dspic_flash_random_word(chip) : *word & (meant | dspic_flash_random_word(chip));
    }
}

struct operation {
    unsigned words;
    uint32_t frc_cycles;
    bool erase;
};

static struct operation dspic_flash_operation_of(uint16_t nvmcon)
{
    switch (nvmcon & (uint16_t)~NVMCON_WR & 0x40FFu) {
    case NVMCON_ERASE_PAGE:
        return (struct operation){FLASH_PAGE_WORDS, FLASH_PAGE_ERASE_FRC, true};
    case NVMCON_WRITE_ROW:
        return (struct operation){FLASH_ROW_WORDS, FLASH_ROW_WRITE_FRC, false};
    case NVMCON_WRITE_WORD:
        return (struct operation){1u, FLASH_WORD_WRITE_FRC, false};
    default:
        return (struct operation){0};
    }
}

static void dspic_flash_operate(struct dspic *chip, struct operation o)
{
    const uint32_t first = chip->target / o.words * o.words;
    const double frc_fs = 1e15 / (FRC_HZ * (1.0 + chip->parameters.frc_ppm * 1e-6));
    const uint64_t start = chip->now_fs, end = start + (uint64_t)(o.frc_cycles * frc_fs);
    const uint64_t cut = chip->due_fs[EVENT_POWER];
    dspic_flash_apply(chip, first, o.words, o.erase, cut < end ? (double)(cut - start) / (double)(end - start) : 1.0);
    dspic_stall(chip, end);
    for (unsigned i = 0; i < FLASH_ROW_WORDS; i++)
        chip->latch[i] = 0xFFFFFFu;
}

enum { KEY_CYCLES = 2 }; /* between two steps: as the family's documents show the sequence (C) */

/* WR is only taken right after the two keys: what comes between, an interrupt, voids them. */
void flash_wrote(struct dspic *chip, unsigned address, uint16_t old)
{
    uint16_t *nvmcon = dspic_chip_sfr(chip, NVMCON);
    if (address == NVMKEY) {
        const uint16_t key = *dspic_chip_sfr(chip, NVMKEY);
        const bool second = dspic_chip_key_in_time(chip, KEY_CYCLES) && chip->flash_key == 1u && key == NVMKEY_2;
        chip->flash_key = key == NVMKEY_1 ? 1u : second ? 2u : 0u;
        return;
    }
    const bool start = *nvmcon & ~old & NVMCON_WR,
               unlocked = chip->flash_key == 2u && dspic_chip_key_in_time(chip, KEY_CYCLES);
    chip->flash_key = 0;
    if (!start)
        return;
    const struct operation o = dspic_flash_operation_of(*nvmcon);
    if (!unlocked || o.words == 0) {
        chip->violations.unlock++;
        *nvmcon = old;
        return;
    }
    dspic_flash_operate(chip, o);
    *nvmcon &= (uint16_t)~NVMCON_WR;
}

uint32_t *dspic_flash(struct dspic *chip)
{
    return chip->flash;
}
