/* The RP2040's registers that this firmware uses: addresses and bits of the RP2040 data sheet, whose
 * section each group names (its list of registers). */
#ifndef RP2040_H
#define RP2040_H

#include <stdint.h>

#define REG(address) (*(volatile uint32_t *)(address))
#define SET(address) REG((address) + 0x2000u)   /* writes set bits; not of SIO, DPRAM, the processor's own */
#define CLEAR(address) REG((address) + 0x3000u) /* writes clear bits; likewise */

/* 2.8, boot ROM; 2.6, addresses */
#define ROM_FUNCTIONS 0x14u /* 16 bits: where the table is */
#define ROM_LOOK_UP 0x18u   /* . what finds in it */
#define RAM_BASE UINT32_C(0x20000000)
#define FLASH_PROGRAM UINT32_C(0x10000100) /* behind boot stage 2 */

/* 4.10, SSI */
#define SSI_CTRLR0 UINT32_C(0x18000000)
#define SSI_CTRLR1 UINT32_C(0x18000004)
#define SSI_SSIENR UINT32_C(0x18000008)
#define SSI_SER UINT32_C(0x18000010)
#define SSI_BAUDR UINT32_C(0x18000014)
#define SSI_RXFLR UINT32_C(0x18000024)
#define SSI_DR0 UINT32_C(0x18000060)
#define SSI_SPI_CTRLR0 UINT32_C(0x180000F4)

/* 2.15, clocks */
#define CLK_REF_CTRL UINT32_C(0x40008030)
#define CLK_REF_SELECTED UINT32_C(0x40008038)
#define CLK_SYS_CTRL UINT32_C(0x4000803C)
#define CLK_SYS_SELECTED UINT32_C(0x40008044)
#define CLK_PERI_CTRL UINT32_C(0x40008048)
#define CLK_USB_CTRL UINT32_C(0x40008054)
#define CLK_ENABLE (1u << 11)
/* 2.16, crystal oscillator */
#define XOSC_CTRL UINT32_C(0x40024000)
#define XOSC_STATUS UINT32_C(0x40024004)
#define XOSC_STARTUP UINT32_C(0x4002400C)
#define READY (1u << 31) /* of XOSC_STATUS and a PLL's CS */
/* 2.18, PLL */
#define PLL_SYS UINT32_C(0x40028000)
#define PLL_USB UINT32_C(0x4002C000)
#define PLL_CS 0x0u
#define PLL_PWR 0x4u
#define PLL_FBDIV 0x8u
#define PLL_PRIM 0xCu
#define PLL_POWER (1u << 0 | 1u << 5) /* of PLL_PWR: off: the loop and its oscillator */
#define PLL_POST (1u << 3)            /* of PLL_PWR: off: the dividers behind it */

/* 2.14, subsystem resets */
#define RESETS UINT32_C(0x4000C000)
#define RESETS_DONE UINT32_C(0x4000C008)
#define RESET_IO (1u << 5)
#define RESET_PADS (1u << 8)
#define RESET_PLLS (1u << 12 | 1u << 13)
#define RESET_SPI (1u << 16 | 1u << 17)
#define RESET_TIMER (1u << 21)
#define RESET_USB (1u << 24)
/* 2.13, power-on state machine */
#define PSM_WDSEL UINT32_C(0x40010008)
#define PSM_ALL_BUT_OSCILLATORS 0x1FFFCu
/* 2.12, chip-level reset */
#define CHIP_RESET UINT32_C(0x40064008)
#define CHIP_RESET_RUN (1u << 16) /* by the pin RUN */

/* 2.19, GPIO */
#define IO_CTRL(pin) (UINT32_C(0x40014004) + 8u * (pin))
#define IO_SPI 1u
#define IO_SIO 5u
#define PAD(pin) (UINT32_C(0x4001C004) + 4u * (pin))
#define PAD_INPUT_PULLED_UP 0x5Au /* input on, 4 mA, pull-up, hysteresis */
/* 2.3.1, SIO */
#define SIO_OUT_SET UINT32_C(0xD0000014)
#define SIO_OUT_CLEAR UINT32_C(0xD0000018)
#define SIO_OE_SET UINT32_C(0xD0000024)
#define SIO_DIVIDEND UINT32_C(0xD0000060) /* unsigned */
#define SIO_DIVISOR UINT32_C(0xD0000064)  /* unsigned; writing it begins 8 cycles of division */
#define SIO_QUOTIENT UINT32_C(0xD0000070)

/* 4.4, SPI */
#define SPI(bus) (UINT32_C(0x4003C000) + UINT32_C(0x4000) * (bus))
#define SPI_CR0 0x0u
#define SPI_CR1 0x4u
#define SPI_DR 0x8u
#define SPI_SR 0xCu
#define SPI_CPSR 0x10u
#define SPI_SIXTEEN_BITS 15u
#define SPI_MODE_3 (1u << 6 | 1u << 7)
#define SPI_ON (1u << 1)
#define SPI_BUSY (1u << 4)

/* 4.6, timer */
#define TIMER_ALARM0 UINT32_C(0x40054010)
#define TIMER_ARMED UINT32_C(0x40054020) /* writing 1 disarms */
#define TIMER_NOW UINT32_C(0x40054028)   /* us, low 32 bits */
#define TIMER_INTR UINT32_C(0x40054034)
#define TIMER_INTE UINT32_C(0x40054038)
/* 4.7, watchdog */
#define WATCHDOG_CTRL UINT32_C(0x40058000)
#define WATCHDOG_LOAD UINT32_C(0x40058004)
#define WATCHDOG_REASON UINT32_C(0x40058008)
#define WATCHDOG_SCRATCH0 UINT32_C(0x4005800C)
#define WATCHDOG_TICK UINT32_C(0x4005802C)
#define WATCHDOG_ON (1u << 30)
#define WATCHDOG_FIRE (1u << 31)
#define WATCHDOG_TICK_ON (1u << 9)

/* 2.4, Cortex-M0+ */
#define SYST_CSR UINT32_C(0xE000E010)
#define SYST_RVR UINT32_C(0xE000E014)
#define SYST_CVR UINT32_C(0xE000E018)
#define SYST_ON 7u /* of the processor's clock, with its exception */
#define NVIC_ENABLE UINT32_C(0xE000E100)
#define NVIC_PRIORITY(irq) (UINT32_C(0xE000E400) + ((irq) & ~3u))
#define VTOR UINT32_C(0xE000ED08)
#define IRQ_TIMER0 0u
#define IRQ_USB 5u

/* 4.1, USB */
#define DPRAM UINT32_C(0x50100000)
#define DPRAM_SETUP DPRAM
#define DPRAM_CONTROL_IN(endpoint) (DPRAM + 8u * (endpoint))
#define DPRAM_BUFFER_IN(endpoint) (DPRAM + 0x80u + 8u * (endpoint))
#define DPRAM_BUFFER_OUT0 (DPRAM + 0x84u)
#define DPRAM_DATA0 (DPRAM + 0x100u)
#define DPRAM_DATA(endpoint) (DPRAM + 0x140u + 0x40u * (endpoint))
#define ENDPOINT_ON (1u << 31 | 1u << 29) /* enabled, an interrupt a buffer */
#define ENDPOINT_BULK (2u << 26)
#define ENDPOINT_INTERRUPT (3u << 26)
#define BUFFER_AVAILABLE (1u << 10)
#define BUFFER_STALL (1u << 11)
#define BUFFER_DATA1 (1u << 13)
#define BUFFER_FULL (1u << 15)
#define BUFFER_LENGTH 0x3FFu
#define USB_ADDRESS UINT32_C(0x50110000)
#define USB_MAIN_CTRL UINT32_C(0x50110040)
#define USB_SOF UINT32_C(0x50110048)
#define USB_SIE_CTRL UINT32_C(0x5011004C)
#define USB_SIE_STATUS UINT32_C(0x50110050)
#define USB_BUFF_STATUS UINT32_C(0x50110058)
#define USB_STALL_ARM UINT32_C(0x50110068)
#define USB_MUXING UINT32_C(0x50110074)
#define USB_POWER UINT32_C(0x50110078)
#define USB_INTE UINT32_C(0x50110090)
#define USB_INTS UINT32_C(0x50110098)
#define SIE_INTERRUPT_0 (1u << 29) /* of SIE_CTRL: an interrupt a buffer of endpoint 0 */
#define SIE_PULL_UP (1u << 16)
#define SIE_SUSPENDED (1u << 4) /* of SIE_STATUS, cleared by writing 1 */
#define SIE_RESUME (1u << 11)
#define SIE_SETUP (1u << 17)
#define SIE_RESET (1u << 19)
#define INT_BUFFER (1u << 4)
#define INT_RESET (1u << 12)
#define INT_SUSPEND (1u << 14)
#define INT_RESUME (1u << 15)
#define INT_SETUP (1u << 16)
#define INT_SOF (1u << 17)

#endif
