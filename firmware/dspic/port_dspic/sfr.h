/* How the firmware reaches the chip: registers, and the few instructions that C cannot say.
 *
 * On the chip each accessor is one or two instructions: always_inline, because the chip's compiler leaves a plain
 * `static inline` as a call at -O1, and an interrupt that calls saves ten registers. Anywhere else they reach the
 * register model (sim/dspic), so that the very driver code runs there. `board` is unused on the chip. */
#ifndef SFR_H
#define SFR_H

#include <stdint.h>

#include "dspic33fj128mc802.h"

struct board;

#define SFR_INLINE static inline __attribute__((always_inline))

#ifdef __dsPIC33F__

#define SFR_AT(address) (*(volatile uint16_t *)(uintptr_t)(address))
#define DMA_WORDS_AT(board, offset) ((volatile uint16_t *)(uintptr_t)(DSPIC_DMA_RAM + (offset)))

SFR_INLINE uint16_t sfr_read(struct board *board, uint16_t address)
{
    (void)board;
    return SFR_AT(address);
}

SFR_INLINE void sfr_write(struct board *board, uint16_t address, uint16_t value)
{
    (void)board;
    SFR_AT(address) = value;
}

SFR_INLINE void sfr_set(struct board *board, uint16_t address, uint16_t mask)
{
    (void)board;
    SFR_AT(address) |= mask;
}

SFR_INLINE void sfr_clear(struct board *board, uint16_t address, uint16_t mask)
{
    (void)board;
    SFR_AT(address) &= (uint16_t)~mask;
}

/* Writes a byte of OSCCON behind its unlock sequence, which must not be interrupted. */
SFR_INLINE void cpu_write_osccon_high(struct board *board, uint8_t value)
{
    (void)board;
    __builtin_write_OSCCONH(value);
}

SFR_INLINE void cpu_write_osccon_low(struct board *board, uint8_t value)
{
    (void)board;
    __builtin_write_OSCCONL(value);
}

/* Stops the CPU, not the peripherals, until the next interrupt. */
SFR_INLINE void cpu_idle(struct board *board)
{
    (void)board;
    __asm__ volatile("pwrsav #1");
}

SFR_INLINE void cpu_clear_watchdog(struct board *board)
{
    (void)board;
    __asm__ volatile("clrwdt");
}

SFR_INLINE void cpu_reset(struct board *board)
{
    (void)board;
    __asm__ volatile("reset");
}

/* Starts what NVMCON says, behind the key sequence, interrupts held off; the CPU stalls until it is done. */
SFR_INLINE void cpu_start_flash(struct board *board)
{
    (void)board;
    __asm__ volatile("disi #5");
    __builtin_write_NVM();
}

/* A program word's low 16 bits, or its high byte, at the even address `TBLPAG:offset`. */
SFR_INLINE uint16_t cpu_table_read_low(struct board *board, uint16_t offset)
{
    (void)board;
    return __builtin_tblrdl(offset);
}

SFR_INLINE uint16_t cpu_table_read_high(struct board *board, uint16_t offset)
{
    (void)board;
    return __builtin_tblrdh(offset);
}

/* The same into the flash's holding buffers. */
SFR_INLINE void cpu_table_write_low(struct board *board, uint16_t offset, uint16_t value)
{
    (void)board;
    __builtin_tblwtl(offset, value);
}

SFR_INLINE void cpu_table_write_high(struct board *board, uint16_t offset, uint16_t value)
{
    (void)board;
    __builtin_tblwth(offset, value);
}

#else

#include "chip_board.h" // struct board: holds the model
#include "sfr_model.h"

#define DMA_WORDS_AT(board, offset) (dspic_dma_ram((board)->chip) + (offset) / 2u)

SFR_INLINE uint16_t sfr_read(struct board *board, uint16_t address)
{
    return dspic_sfr_read(board->chip, address);
}

SFR_INLINE void sfr_write(struct board *board, uint16_t address, uint16_t value)
{
    dspic_sfr_write(board->chip, address, value);
}

SFR_INLINE void sfr_set(struct board *board, uint16_t address, uint16_t mask)
{
    dspic_sfr_modify(board->chip, address, mask, mask);
}

SFR_INLINE void sfr_clear(struct board *board, uint16_t address, uint16_t mask)
{
    dspic_sfr_modify(board->chip, address, mask, 0);
}

SFR_INLINE void cpu_write_osccon_high(struct board *board, uint8_t value)
{
    dspic_byte_write(board->chip, OSCCON + 1u, OSCCON_HIGH_KEY1);
    dspic_byte_write(board->chip, OSCCON + 1u, OSCCON_HIGH_KEY2);
    dspic_byte_write(board->chip, OSCCON + 1u, value);
}

SFR_INLINE void cpu_write_osccon_low(struct board *board, uint8_t value)
{
    dspic_byte_write(board->chip, OSCCON, OSCCON_LOW_KEY1);
    dspic_byte_write(board->chip, OSCCON, OSCCON_LOW_KEY2);
    dspic_byte_write(board->chip, OSCCON, value);
}

SFR_INLINE void cpu_idle(struct board *board)
{
    dspic_idle(board->chip);
}

SFR_INLINE void cpu_clear_watchdog(struct board *board)
{
    dspic_clear_watchdog(board->chip);
}

SFR_INLINE void cpu_reset(struct board *board)
{
    dspic_reset(board->chip, RCON_SWR);
}

SFR_INLINE void cpu_start_flash(struct board *board)
{
    dspic_hold_interrupts(board->chip, 5u);
    dspic_sfr_write(board->chip, NVMKEY, NVMKEY_1);
    dspic_sfr_write(board->chip, NVMKEY, NVMKEY_2);
    dspic_sfr_modify(board->chip, NVMCON, NVMCON_WR, NVMCON_WR);
}

SFR_INLINE uint16_t cpu_table_read_low(struct board *board, uint16_t offset)
{
    return dspic_table_read(board->chip, offset, false);
}

SFR_INLINE uint16_t cpu_table_read_high(struct board *board, uint16_t offset)
{
    return dspic_table_read(board->chip, offset, true);
}

SFR_INLINE void cpu_table_write_low(struct board *board, uint16_t offset, uint16_t value)
{
    dspic_table_write(board->chip, offset, false, value);
}

SFR_INLINE void cpu_table_write_high(struct board *board, uint16_t offset, uint16_t value)
{
    dspic_table_write(board->chip, offset, true, value);
}

#endif
#endif
