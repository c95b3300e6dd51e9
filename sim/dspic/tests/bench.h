/* What the model's tests share: a chip whose firmware is the test. Registers in, registers and pins out. */
#ifndef DSPIC_TESTS_BENCH_H
#define DSPIC_TESTS_BENCH_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "dspic.h"

#define US (1000u * DSPIC_FS_PER_NS)
#define MS (1000u * US)

/* RP numbers. */
#define SDO_PIN 7u
#define SCK_PIN 8u
#define SDI_PIN 9u
#define SYNC_PIN 12u
#define SLAVE_SCK 13u
#define SLAVE_SDI 14u
#define SLAVE_SDO 15u
#define SLAVE_SS 5u

struct bench {
    struct dspic *chip;
    unsigned starts, loops, traps;
    unsigned served[IRQ_COUNT];
    unsigned order[8], taken; /* of interrupts */
    uint64_t served_fs;
    unsigned rises, falls; /* of SCK_PIN */
    uint64_t rise_fs;
    uint32_t sent;                                /* bits of SDO_PIN at its falling edges, newest lowest */
    void (*within)(struct bench *, unsigned irq); /* more of an interrupt's body */
    void (*starting)(struct bench *);
    void (*trapping)(struct bench *);
    void (*outside)(struct bench *); /* see dspic_outside_at */
};
extern struct bench bench;

/* A new chip in place of the old, without power; with power. NULL: default parameters. */
void make(const struct dspic_parameters *parameters);
void power(const struct dspic_parameters *parameters);
struct dspic_parameters standard(void);

/* Set-up and tear-down of each test. */
int begin(void **state);
int end(void **state);
#define TEST(name) cmocka_unit_test_setup_teardown(name, begin, end)

uint16_t get(uint16_t address);
void put(uint16_t address, uint16_t value);
void set(uint16_t address, uint16_t bits);
void clear(uint16_t address, uint16_t bits);
void pass(uint64_t fs);
uint64_t cycle_fs(void);

/* Enables an interrupt with this priority; sets its flag; asks for it. */
void enable(unsigned irq, unsigned priority);
void flag(unsigned irq);
bool flagged(unsigned irq);

/* Keys and value to one half of OSCCON: 0 low, 1 high. */
void osccon(uint16_t half, uint8_t key1, uint8_t key2, uint8_t value);
void pll(void); /* asks for FRC with PLL */

/* SPI1 as master on its pins at FCY / 64, eight bits take 139 us from reset on; SPI2 as slave in 16-bit words. */
void master(void);
void slave(void);
void slave_select(bool low);
uint16_t clock_slave(uint16_t out, unsigned bits); /* clocks bits in, top first; returns what came out */

/* DMA channel n at byte 64 n of its RAM, block B 16 bytes on. */
void channel(unsigned n, uint16_t control, uint16_t irq, uint16_t pad, uint16_t items);

#endif
