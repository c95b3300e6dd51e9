/* Boot stage 2: what the chip's ROM copies from the first 256 bytes of flash into RAM, checks and runs. It makes the
 * flash readable in the slowest way that every chip knows, copies the program into RAM and enters it: nothing runs from
 * flash afterwards, so its wait states and the cache change no time. tools/firmware/pico_image.py adds the CRC the ROM
 * wants.
 */
#include "rp2040.h"

extern uint32_t image_start[], image_end[]; /* in RAM (pico.ld) */

/* Read by command 03h, one bit wide, 24 bits of address, 32 of data; a quarter of the system clock. */
#define CTRLR0_READ (31u << 16 | 3u << 8)
#define SPI_CTRLR0_READ (0x03u << 24 | 2u << 8 | 6u << 2)
#define FLASH_DIVIDER 4u

__attribute__((section(".boot2"), used, noreturn, optimize("Os"))) void boot2(void)
{
    REG(SSI_SSIENR) = 0;
    REG(SSI_BAUDR) = FLASH_DIVIDER;
    REG(SSI_CTRLR0) = CTRLR0_READ;
    REG(SSI_SPI_CTRLR0) = SPI_CTRLR0_READ;
    REG(SSI_CTRLR1) = 0; /* one word a time */
    REG(SSI_SSIENR) = 1;
    const volatile uint32_t *from = (const volatile uint32_t *)FLASH_PROGRAM;
    for (volatile uint32_t *to = image_start; to < image_end; to++)
        *to = *from++;
    REG(VTOR) = RAM_BASE;
    __asm volatile("msr msp, %0\n\tbx %1" : : "r"(REG(RAM_BASE)), "r"(REG(RAM_BASE + 4u)));
    __builtin_unreachable();
}
