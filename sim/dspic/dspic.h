/* The dsPIC33FJ128MC802 as its firmware sees it: registers with their side effects, in virtual time.
 *
 * Modelled: SPI1, SPI2, DMA with ping-pong, T1 to T3, INT1, INT2, pin select, ports, interrupt priorities and nesting,
 * clock switch behind its unlock sequence, watchdog, flash self-programming with power cuts, reset causes. Firmware
 * runs as native code; it takes time where it touches the chip, each access a cycle, at each interrupt's entry and
 * exit, and where dspic_compute says so. Interrupts nest at accesses. Not modelled: the CPU's own instructions, PSV,
 * other peripherals; writes to their registers are kept and do nothing.
 *
 * A chip and what is wired to it belong to one thread. */
#ifndef DSPIC_H
#define DSPIC_H

#include <stdbool.h>
#include <stdint.h>

#include "dspic33fj128mc802.h"
#include "sfr_model.h" // what the firmware's register accessors call

struct dspic;

enum dspic_drive { DSPIC_LOW, DSPIC_HIGH, DSPIC_FLOAT };

enum dspic_trap { DSPIC_TRAP_OSCILLATOR, DSPIC_TRAP_STACK, DSPIC_TRAP_ADDRESS, DSPIC_TRAP_MATH, DSPIC_TRAP_DMA };

/* What is not known for sure, or differs from part to part. */
struct dspic_parameters {
    int32_t frc_ppm;         /* error of the internal oscillator; the data sheet allows +-20 000 to 85 degrees C */
    uint8_t slave_prefetch;  /* 1: a slave's word waits in the buffer for the first clock; 2: it moves into the shift
                              * register at once and leaves room for another. The data sheet does not say. */
    uint8_t spi_deaf_cycles; /* a write to SPIxBUF so soon after SPIEN is set is ignored, as errata of the family say of
                                one right after SPITBF is cleared (C) */
    uint8_t entry_cycles;    /* interrupt latency: 5 (A) */
    uint8_t exit_cycles;     /* 3 (A) */
    uint16_t pll_lock_us;    /* from the switch to LOCK */
    uint8_t pll_failures;    /* so many switches, counted from the chip's making, never end: the PLL does not lock */
    bool keeps_clock;        /* a reset other than power-on leaves COSC, NOSC and LOCK as they are (A for sibling
                              * families, C for this one); PLLFBD and CLKDIV go back to their reset values either way */
    uint16_t watchdog_ms;    /* FWDT's period at the nominal LPRC */
    uint8_t dma_cycles;      /* from a peripheral's request to its transfer; not documented */
    bool pins_lock_once;     /* FOSC's IOL1WAY: a pin map that was locked stays locked until reset */
    uint16_t device_id;      /* DEVID, what the flash's owner reads at 0xFF0000 */
    uint32_t serial;         /* FUID0 to FUID3, lowest first; all ones as it leaves the factory */
    uint64_t seed;           /* of what a power cut leaves in the flash */
};

void dspic_parameters_default(struct dspic_parameters *parameters);

/* What is connected to the chip, and the code it runs. Called from within the functions below. */
struct dspic_wiring {
    void *context;
    void (*pin)(void *context, unsigned rp, enum dspic_drive, uint64_t now_fs); /* RB0 to RB15 changes */
    void (*start)(void *context); /* from the reset vector to the main loop */
    void (*loop)(void *context);  /* one turn of the main loop, after each interrupt that ended idle */
    void (*interrupt)(void *context, unsigned irq); /* body of IRQ_* */
    void (*trap)(void *context, enum dspic_trap);
    void (*outside)(void *context); /* see dspic_outside_at */
};

/* What the firmware did that the data sheet forbids. Tests demand zero. */
struct dspic_violations {
    uint32_t overclocked;   /* FCY, VCO or PLL input outside their limits */
    uint32_t pll_running;   /* PLLFBD or CLKDIV written while the PLL ran the chip */
    uint32_t spi_settings;  /* SPIxCON written while the module was enabled (ignored) */
    uint32_t spi_disabled;  /* SPIxBUF written while it was disabled (ignored) */
    uint32_t spi_overwrite; /* SPIxBUF written while SPITBF was set (the older word is lost) */
    uint32_t pins_locked;   /* pin map written while locked (ignored) */
    uint32_t unlock;        /* OSCCON or NVMCON written without its key sequence, or too late after it (ignored) */
};

/* Without power. NULL: no memory. */
struct dspic *dspic_new(const struct dspic_parameters *parameters, const struct dspic_wiring *wiring);
void dspic_free(struct dspic *chip);

/* Times are femtoseconds since the chip was made and never go back: 5 hours at most. */
#define DSPIC_FS_PER_NS UINT64_C(1000000)
void dspic_power_on(struct dspic *chip, uint64_t now_fs);
void dspic_power_off(struct dspic *chip, uint64_t now_fs);
void dspic_run_until(struct dspic *chip, uint64_t until_fs);
uint64_t dspic_now_fs(const struct dspic *chip);

/* When something happens next by itself; UINT64_MAX: nothing. */
uint64_t dspic_next_fs(const struct dspic *chip);

/* The main loop idles with no interrupt pending, and nothing but the watchdog and a free-running T3 is to come. Then so
 * much time may pass in which nothing happens: what is to come moves with it. */
bool dspic_rests(const struct dspic *chip);
void dspic_skip(struct dspic *chip, uint64_t fs);

/* The supply fails at this time, also in the middle of an erase or write, which is then done in part. */
void dspic_cut_power_at(struct dspic *chip, uint64_t at_fs);
bool dspic_powered(const struct dspic *chip);

/* The firmware computes for so many cycles, from within a callback that runs it: now, or so that its next write to the
 * register at `address` comes no sooner than that. */
void dspic_compute(struct dspic *chip, uint64_t cycles);
void dspic_compute_until(struct dspic *chip, uint64_t cycles, uint16_t address);
uint64_t dspic_cycle_fs(const struct dspic *chip);

/* The outside drives pin RB0 to RB15, from `now_fs` on. Peripherals react at once, interrupts when time goes on. */
void dspic_input(struct dspic *chip, unsigned rp, bool level, uint64_t now_fs);

/* wiring.outside is called once at this time, exactly, whatever the firmware is doing; it may call dspic_input for the
 * present time, dspic_outside_at and dspic_disturb_*. One such time is remembered. */
void dspic_outside_at(struct dspic *chip, uint64_t at_fs);

/* Sets a pin from within the pin callback; the pin's edges start nothing (data of a master). */
void dspic_wire(struct dspic *chip, unsigned rp, bool level);

enum dspic_drive dspic_output(const struct dspic *chip, unsigned rp);

/* A brown-out or the reset pin (RCON_BOR, RCON_EXTR), a trap: at the present time. */
void dspic_disturb_reset(struct dspic *chip, uint16_t cause);
void dspic_disturb_trap(struct dspic *chip, enum dspic_trap trap);

/* The CPU stands still, interrupts and all, until something resets it; peripherals and DMA go on. */
void dspic_disturb_hang(struct dspic *chip);

/* CPU and DMA channel write at once, to a word of the DMA RAM or to a peripheral: its bit in DMACS0, and the trap. */
void dspic_disturb_collision(struct dspic *chip, unsigned channel, bool peripheral);

/* SPI 1 or 2 finds its receive buffer full, though nothing was left unread: the next word overflows. */
void dspic_disturb_unread(struct dspic *chip, unsigned spi);

/* Flash as 24-bit words, FLASH_WORDS of them, for first programming and for tests; kept without power. */
uint32_t *dspic_flash(struct dspic *chip);

struct dspic_violations dspic_violations(const struct dspic *chip);
uint64_t dspic_busy_fs(const struct dspic *chip); /* time in interrupts, stalls included */
uint64_t dspic_interrupts(const struct dspic *chip);
uint32_t dspic_fcy_hz(const struct dspic *chip);

#endif
