/* DMA: each channel moves one item per request of the interrupt it is tied to. */
#include <string.h>

#include "dspic_chip.h"

static uint16_t *dspic_dma_reg(struct dspic *chip, unsigned channel, unsigned address)
{
    return dspic_chip_sfr(chip, address + channel * DMA_STRIDE);
}

static uint16_t *dspic_dma_item(struct dspic *chip, unsigned channel)
{
    const struct dma *d = &chip->dma[channel];
    const unsigned size = *dspic_dma_reg(chip, channel, DMA0CON) & DMACON_BYTE ? 1u : 2u;
    const unsigned start = *dspic_dma_reg(chip, channel, d->second ? DMA0STB : DMA0STA);
    return &chip->dma_ram[(start + d->done * size) / 2u % DSPIC_DMA_RAM_WORDS];
}

static void dspic_dma_move(struct dspic *chip, unsigned channel)
{
    uint16_t *ram = dspic_dma_item(chip, channel);
    const uint16_t control = *dspic_dma_reg(chip, channel, DMA0CON), pad = *dspic_dma_reg(chip, channel, DMA0PAD);
    const uint64_t now = chip->now_fs;
    if (control & DMACON_FROM_RAM) {
        const uint16_t old = *dspic_chip_sfr(chip, pad);
        *dspic_chip_sfr(chip, pad) = *ram;
        if (pad == SPI1BUF || pad == SPI2BUF)
            spi_wrote(chip, pad == SPI2BUF, pad, old);
    } else {
        *ram = pad == SPI1BUF || pad == SPI2BUF ? spi_read_buffer(chip, pad == SPI2BUF) : *dspic_chip_sfr(chip, pad);
    }
    chip->now_fs = now;
}

static void dspic_dma_end_block(struct dspic *chip, unsigned channel)
{
    static const uint8_t IRQ[DMA_CHANNELS] = {IRQ_DMA0, IRQ_DMA1, IRQ_DMA2, 36, 46, 61, 68, 69};
    struct dma *d = &chip->dma[channel];
    uint16_t *control = dspic_dma_reg(chip, channel, DMA0CON);
    const bool ping_pong = *control & DMACON_MODE_PING_PONG;
    d->done = 0;
    if (*control & DMACON_MODE_ONE_SHOT && (!ping_pong || d->second))
        *control &= (uint16_t)~DMACON_CHEN;
    d->second = ping_pong && !d->second;
    *dspic_chip_sfr(chip, DMACS1) = (uint16_t)((*dspic_chip_sfr(chip, DMACS1) & ~(1u << channel) & 0x00FFu) |
                                               (unsigned)d->second << channel | channel << 8);
    dspic_irq_raise(chip, IRQ[channel]);
}

static void dspic_dma_serve(struct dspic *chip, unsigned channel)
{
    dspic_dma_move(chip, channel);
    if (chip->dma[channel].done++ == *dspic_dma_reg(chip, channel, DMA0CNT))
        dspic_dma_end_block(chip, channel);
}

static void dspic_dma_serve_all(struct dspic *chip, unsigned irq, uint64_t raised_fs)
{
    for (unsigned c = 0; c < DMA_CHANNELS; c++) {
        const bool its =
            (*dspic_dma_reg(chip, c, DMA0REQ) & 0x7Fu) == irq && irq != 0 && chip->dma[c].enabled_fs <= raised_fs;
        if (*dspic_dma_reg(chip, c, DMA0CON) & DMACON_CHEN && its)
            dspic_dma_serve(chip, c);
    }
}

static bool dspic_dma_wanted(const struct dspic *chip, unsigned irq)
{
    for (unsigned c = 0; c < DMA_CHANNELS; c++) {
        const unsigned at = (DMA0CON + c * DMA_STRIDE) / 2u;
        if (chip->sfr[at] & DMACON_CHEN && (chip->sfr[at + 1u] & 0x7Fu) == irq && irq != 0)
            return true;
    }
    return false;
}

void dma_request(struct dspic *chip, unsigned irq)
{
    if (chip->parameters.dma_cycles == 0) {
        dspic_dma_serve_all(chip, irq, chip->now_fs);
    } else if (chip->requested < sizeof chip->requests / sizeof *chip->requests && dspic_dma_wanted(chip, irq)) {
        const uint64_t at = chip->now_fs + chip->parameters.dma_cycles * chip->cycle_fs;
        chip->requests[chip->requested++] = (struct request){chip->now_fs, at, (uint8_t)irq};
        dspic_plan_event(chip, EVENT_DMA, chip->requests[0].at_fs);
    }
}

void dma_event(struct dspic *chip)
{
    const struct request first = chip->requests[0];
    chip->requested--;
    memmove(chip->requests, chip->requests + 1, chip->requested * sizeof *chip->requests);
    if (chip->requested > 0)
        dspic_plan_event(chip, EVENT_DMA, chip->requests[0].at_fs);
    dspic_dma_serve_all(chip, first.irq, first.raised_fs);
}

/* Enabling begins a block anew; FORCE asks for one item at once. */
void dma_wrote(struct dspic *chip, unsigned address, uint16_t old)
{
    const unsigned channel = (address - DMA0CON) / DMA_STRIDE, at = (address - DMA0CON) % DMA_STRIDE;
    const uint16_t now = *dspic_chip_sfr(chip, address);
    if (at == DMA0CON - DMA0CON && now & ~old & DMACON_CHEN)
        chip->dma[channel] = (struct dma){.enabled_fs = chip->now_fs};
    if (at == DMA0REQ - DMA0CON && now & DMAREQ_FORCE) {
        *dspic_chip_sfr(chip, address) = now & (uint16_t)~DMAREQ_FORCE;
        if (*dspic_dma_reg(chip, channel, DMA0CON) & DMACON_CHEN)
            dspic_dma_serve(chip, channel);
    }
}
