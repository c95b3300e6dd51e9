/* The chip's processor: executes a translated image, instruction by instruction, in the time of the chip's model.
 *
 * Registers and program memory are those of sim/dspic; working registers, flags and data memory are here. Cycles are
 * the data sheet's: one an instruction, more for branches taken, returns, tables, constants read from flash, and a
 * stall where an instruction reads through a register that the one before it has written. */
#ifndef IMAGE_CPU_H
#define IMAGE_CPU_H

#include <stdbool.h>
#include <stdint.h>

#include "dspic_chip.h" // registers_read, registers_write
#include "image_table.h"

#define IMAGE_RAM_START 0x0800u
#define IMAGE_CORE_END 0x0032u /* working registers and stack limit; what lies behind is the chip's */

enum { IMAGE_UNIQUES = 64, IMAGE_FLAGS = 32 };

/* How the program has run, by flash word: what the worst case by path (paths.py) must know. One for all nodes. */
struct image_trace {
    uint32_t epoch;                 /* of the present interrupt */
    uint32_t seen[FLASH_WORDS];     /* the epoch in which `times` counts */
    uint16_t times[FLASH_WORDS];    /* a backward branch was taken in it */
    uint16_t most[FLASH_WORDS];     /* at most, in any one interrupt */
    uint8_t constants[FLASH_WORDS]; /* 1: it has read flash as data */
};

struct image_cpu {
    struct dspic *chip;
    const struct image_table *table;
    struct image_trace *trace;    /* or NULL */
    uint32_t pc;                  /* index of a flash word */
    uint8_t core[IMAGE_CORE_END]; /* W0 to W15, SPLIM */
    uint8_t ram[DSPIC_DMA_RAM - IMAGE_RAM_START];
    uint32_t flags[IMAGE_FLAGS];
    uint32_t uniques[IMAGE_UNIQUES];
    uint16_t late; /* registers that the last instruction wrote */
    bool repeated; /* the last one was a repetition's head or part */
    bool returned; /* from an interrupt */
    bool idles;    /* has reached its idle instruction */
    bool faulty;   /* the instruction met a trap's cause, this one */
    enum dspic_trap fault;
    uint32_t next;    /* where the instruction leads */
    int32_t extra;    /* cycles beside its own */
    uint64_t cycles;  /* spent so far */
    uint16_t deepest; /* highest W15 */
    uint64_t acted;   /* `cycles` when the program last wrote a register that the outside sees at once */
};

/* Puts the processor as after a reset: at the reset vector, stack and flags as the data sheet says; data memory stays.
 */
void image_cpu_reset(struct image_cpu *cpu);

/* Data memory full of anything, as a supply that comes on leaves it. */
void image_cpu_scramble(struct image_cpu *cpu, uint64_t seed);

/* Goes on until the idle instruction, or until the chip hangs. */
void image_cpu_run(struct image_cpu *cpu);

/* The stack pointer, and the status register. */
uint16_t image_cpu_stack(const struct image_cpu *cpu);
uint16_t image_cpu_status(const struct image_cpu *cpu);

/* Runs from the vector at this address of program memory to the return from it. */
void image_cpu_interrupt(struct image_cpu *cpu, uint32_t vector);

#endif
