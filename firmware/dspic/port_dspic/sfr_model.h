/* What the register accessors call where there is no chip: a register model provides these (sim/dspic). */
#ifndef SFR_MODEL_H
#define SFR_MODEL_H

#include <stdbool.h>
#include <stdint.h>

struct dspic;

/* One access, one cycle, with the register's side effects. Addresses are even and below DSPIC_SFR_END. */
uint16_t dspic_sfr_read(struct dspic *chip, uint16_t address);
void dspic_sfr_write(struct dspic *chip, uint16_t address, uint16_t value);

/* The bits of `mask` become those of `value`, in one instruction: what the hardware sets meanwhile is not lost. */
void dspic_sfr_modify(struct dspic *chip, uint16_t address, uint16_t mask, uint16_t value);

/* Writes half a register: only OSCCON's halves, behind their unlock sequences. */
void dspic_byte_write(struct dspic *chip, uint16_t address, uint8_t value);

/* DSPIC_DMA_RAM_WORDS words. */
uint16_t *dspic_dma_ram(struct dspic *chip);

/* The DISI instruction: no interrupt but those of priority 7 for so many cycles. */
void dspic_hold_interrupts(struct dspic *chip, uint16_t cycles);

void dspic_idle(struct dspic *chip);
void dspic_clear_watchdog(struct dspic *chip);
void dspic_reset(struct dspic *chip, uint16_t cause); /* RCON_*; does not return */

/* Program memory at TBLPAG:offset, and its holding buffers. */
uint16_t dspic_table_read(struct dspic *chip, uint16_t offset, bool high);
void dspic_table_write(struct dspic *chip, uint16_t offset, bool high, uint16_t value);

#endif
