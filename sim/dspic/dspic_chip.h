/* The chip's insides, shared by the blocks of the model. */
#ifndef DSPIC_CHIP_H
#define DSPIC_CHIP_H

#include <setjmp.h>

#include "dspic.h"

#define NEVER UINT64_MAX

/* What happens by itself, each at one time. */
enum event {
    EVENT_SPI1,
    EVENT_SPI2,
    EVENT_T1,
    EVENT_T2,
    EVENT_T3,
    EVENT_DMA,
    EVENT_PLL,
    EVENT_DISI, /* interrupts are held off no longer */
    EVENT_WATCHDOG,
    EVENT_POWER,
    EVENT_OUTSIDE, /* last: neither a reset nor a power cut stops it */
    EVENTS
};

struct spi {
    uint16_t transmit, receive; /* the two halves of SPIxBUF */
    uint16_t word;              /* being sent, whole */
    uint16_t out, in;           /* shift registers */
    uint64_t half_fs;           /* master: half a bit */
    uint64_t enabled_fs;        /* when SPIEN was set */
    uint8_t bit;                /* bits done of this word */
    bool loaded;                /* `word` waits for its first clock */
    bool shifting;              /* master: a word is under way */
    bool high;                  /* level of SCK */
    bool sdo;
};

struct timer {
    uint64_t since_fs; /* when the count was `from` */
    uint16_t from;
};

struct request {
    uint64_t raised_fs, at_fs;
    uint8_t irq;
};

struct dma {
    uint64_t enabled_fs; /* older requests are not this block's */
    uint16_t done;       /* transfers of the present block */
    bool second;         /* ping-pong: in block B */
};

struct dspic {
    struct dspic_parameters parameters;
    struct dspic_wiring wiring;
    uint64_t now_fs, cycle_fs;
    uint64_t due_fs[EVENTS];
    uint64_t soon_fs; /* none of them is due before */
    uint64_t busy_fs, interrupts;
    uint64_t computed_fs; /* the next write to `computed_for` comes then */
    uint16_t computed_for;
    bool powered;
    jmp_buf *unwind; /* to where a reset or power cut throws the running firmware */
    uint16_t cause;  /* of the reset under way; 0: power cut */
    unsigned level;  /* priority the CPU runs at; 0: main loop */
    bool in_start;   /* the main loop is not yet reached */
    bool idle;       /* the main loop has stopped the CPU until the next interrupt */
    bool hung;       /* the CPU does nothing any more */
    uint16_t sfr[DSPIC_SFR_END / 2u];
    uint16_t dma_ram[DSPIC_DMA_RAM_WORDS];
    struct spi spi[2];
    struct timer timer[3];
    struct dma dma[DMA_CHANNELS];
    struct request requests[4]; /* of DMA, oldest first */
    unsigned requested;
    uint16_t inputs;                      /* levels that the outside drives, RB0 to RB15 */
    uint8_t spi_pin[2][2];                /* RP number that SPI n's SCK and SDO go to; 16: none */
    bool look;                            /* an interrupt may have become ready */
    uint8_t drive[16];                    /* enum dspic_drive */
    uint8_t high_key, low_key, flash_key; /* steps of an unlock sequence done */
    uint64_t key_fs;                      /* when the latest of them was */
    uint64_t held_fs;                     /* DISI holds interrupts off until then */
    uint8_t pll_failed;                   /* switches that never ended */
    bool pins_were_locked;
    uint32_t flash[FLASH_WORDS];
    uint32_t latch[FLASH_ROW_WORDS];
    uint32_t target; /* word of the last table write: the page, row or word that an operation works on */
    uint64_t random;
    struct dspic_violations violations;
};

/* registers.c: one access with its side effects, and no time */
uint16_t registers_read(struct dspic *chip, unsigned address);
void registers_write(struct dspic *chip, unsigned address, uint16_t value);

static inline uint16_t *dspic_chip_sfr(struct dspic *chip, unsigned address)
{
    return &chip->sfr[address / 2u];
}

/* True if at most so many cycles have passed since the latest step of an unlock sequence; notes this one. */
static inline bool dspic_chip_key_in_time(struct dspic *chip, unsigned cycles)
{
    const bool in_time = chip->now_fs - chip->key_fs <= cycles * chip->cycle_fs;
    chip->key_fs = chip->now_fs;
    return in_time;
}

/* dspic.c */
typedef void chip_step(struct dspic *chip, uint64_t argument);
/* Runs a step that may run firmware; a reset within it boots the chip and goes on in `again`. */
void dspic_chip_enter(struct dspic *chip, chip_step *first, chip_step *again, uint64_t argument);
/* Leaves the running firmware, wherever it is: a reset (cause RCON_*) or the end of the supply (0). */
void dspic_chip_throw_out(struct dspic *chip, uint16_t cause);

/* events.c */
void dspic_plan_event(struct dspic *chip, enum event event, uint64_t at_fs);
void event_handle(struct dspic *chip, enum event event);
/* Lets everything happen that is due up to `until_fs`, interrupts apart. */
void events_pass(struct dspic *chip, uint64_t until_fs);
/* Time passes for the firmware; interrupts of a higher priority may come in. */
void dspic_spend(struct dspic *chip, uint64_t cycles);
/* Time passes with the CPU stalled: peripherals go on, interrupts wait. */
void dspic_stall(struct dspic *chip, uint64_t until_fs);

/* interrupts.c */
void dspic_irq_raise(struct dspic *chip, unsigned irq); /* sets its flag and starts its DMA */
void dspic_irq_take(struct dspic *chip);                /* takes all that may be taken now */

/* spi.c */
void spi_wrote(struct dspic *chip, unsigned n, unsigned address, uint16_t old);
uint16_t spi_read_buffer(struct dspic *chip, unsigned n);
void spi_event(struct dspic *chip, unsigned n);
void spi_input(struct dspic *chip, unsigned rp, bool level);
/* Output of pin function RP_*; with the module or its output off the pin stays the port's. */
void spi_drives(const struct dspic *chip, unsigned function, bool *driven, bool *level);

/* dma.c */
void dma_request(struct dspic *chip, unsigned irq);
void dma_event(struct dspic *chip);
void dma_wrote(struct dspic *chip, unsigned address, uint16_t old);

/* timer.c */
void timer_wrote(struct dspic *chip, unsigned address, uint16_t old);
uint16_t timer_count(const struct dspic *chip, unsigned n);
void timer_event(struct dspic *chip, unsigned n);
void timers_rescale(struct dspic *chip, uint64_t old_cycle_fs);

/* pins.c */
void pins_refresh(struct dspic *chip);                    /* after a change of map or port */
void pins_of_spi(struct dspic *chip, unsigned n);         /* after one of SPI n's state */
bool pin_level(const struct dspic *chip, unsigned field); /* level at the RP pin of an input field's number */
unsigned pin_input_field(const struct dspic *chip, unsigned address, unsigned shift);

/* system.c */
void system_reset(struct dspic *chip, uint16_t cause);
void system_clock(struct dspic *chip);
bool system_runs_on_pll(const struct dspic *chip);
void system_pll_event(struct dspic *chip);
void system_wake(struct dspic *chip); /* from idle, if it is */
void dspic_watchdog_restart(struct dspic *chip);
void dspic_watchdog_event(struct dspic *chip);

/* flash.c */
void flash_wrote(struct dspic *chip, unsigned address, uint16_t old);

#endif
