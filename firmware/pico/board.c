#include "board.h"

#include "rp2040.h"

/* Pins (docs/first_whisker.md; tests/repository holds table and picture against these lines). */
static const uint8_t PIN_SELECT[BOARD_LANES] = {5, 16, 6, 17, 7, 18, 8, 19, 9, 20, 13, 21, 14, 26, 15, 27};
static const uint8_t PIN_SCK[BOARD_BUSES] = {2, 10}, PIN_MOSI[BOARD_BUSES] = {3, 11}, PIN_MISO[BOARD_BUSES] = {4, 12};
#define PIN_CONVERT 22u
#define PIN_LAMP 25u

#define XOSC_ON 0xFABAA0u      /* 1 to 15 MHz, enabled */
#define XOSC_STARTUP_256 3008u /* times 256 cycles: 64 ms, for crystals that start slowly */
#define CRYSTAL_MHZ 12u
#define SPI_DIVIDER 12u        /* of 120 MHz: 10 MHz, the most that both sensors take */
#define CONVERT_NOPS 30u       /* 1 us of four cycles each: more than either sensor's shortest pulse */
#define WATCHDOG_US 2000000u   /* a second: the counter goes down twice a microsecond (erratum RP2040-E1) */
#define FAULT_MARK 0x464C5431u /* in a scratch register, which a watchdog's reset leaves alone */
#define FLASH_UNIQUE_ID 0x4Bu  /* command, four bytes of no meaning, eight of the number */
#define FLASH_UNIQUE_BYTES 13u

static void board_pll(uint32_t pll, uint32_t feedback, uint32_t post)
{
    REG(pll + PLL_FBDIV) = feedback;
    CLEAR(pll + PLL_PWR) = PLL_POWER;
    while (!(REG(pll + PLL_CS) & READY)) {
    }
    REG(pll + PLL_PRIM) = post;
    CLEAR(pll + PLL_PWR) = PLL_POST;
}

/* Crystal 12 MHz; processor and peripherals 1440 / 6 / 2 = 120 MHz; USB 1200 / 5 / 5 = 48 MHz. */
static void board_clocks(void)
{
    REG(XOSC_STARTUP) = XOSC_STARTUP_256;
    REG(XOSC_CTRL) = XOSC_ON;
    while (!(REG(XOSC_STATUS) & READY)) {
    }
    board_pll(PLL_SYS, 120, 6u << 16 | 2u << 12);
    board_pll(PLL_USB, 100, 5u << 16 | 5u << 12);
    REG(CLK_REF_CTRL) = 2; /* crystal */
    while (REG(CLK_REF_SELECTED) != 1u << 2) {
    }
    REG(CLK_SYS_CTRL) = 1; /* PLL_SYS */
    while (REG(CLK_SYS_SELECTED) != 1u << 1) {
    }
    REG(CLK_PERI_CTRL) = CLK_ENABLE;
    REG(CLK_USB_CTRL) = CLK_ENABLE;
    REG(WATCHDOG_TICK) = CRYSTAL_MHZ | WATCHDOG_TICK_ON; /* the timer's, too */
}

static void board_output(uint32_t pin, bool high)
{
    REG(high ? SIO_OUT_SET : SIO_OUT_CLEAR) = 1u << pin;
    REG(SIO_OE_SET) = 1u << pin;
    REG(IO_CTRL(pin)) = IO_SIO;
}

static bool mode_3; /* of both buses */

static void board_set_mode(bool wanted)
{
    mode_3 = wanted;
    for (uint32_t bus = 0; bus < BOARD_BUSES; bus++) {
        REG(SPI(bus) + SPI_CR1) = 0;
        REG(SPI(bus) + SPI_CR0) = SPI_SIXTEEN_BITS | (wanted ? SPI_MODE_3 : 0u);
        REG(SPI(bus) + SPI_CR1) = SPI_ON;
    }
}

static void board_pins(void)
{
    for (uint32_t lane = 0; lane < BOARD_LANES; lane++)
        board_output(PIN_SELECT[lane], true);
    board_output(PIN_CONVERT, true);
    board_output(PIN_LAMP, false);
    for (uint32_t bus = 0; bus < BOARD_BUSES; bus++) {
        REG(PAD(PIN_MISO[bus])) = PAD_INPUT_PULLED_UP; /* where no sensor drives it, all ones */
        REG(IO_CTRL(PIN_SCK[bus])) = REG(IO_CTRL(PIN_MOSI[bus])) = REG(IO_CTRL(PIN_MISO[bus])) = IO_SPI;
        REG(SPI(bus) + SPI_CPSR) = SPI_DIVIDER;
    }
    board_set_mode(false);
}

static enum board_start board_cause(void)
{
    const bool fault = REG(WATCHDOG_SCRATCH0) == FAULT_MARK;
    REG(WATCHDOG_SCRATCH0) = 0;
    if (REG(WATCHDOG_REASON) != 0)
        return fault ? BOARD_START_FAULT : BOARD_START_WATCHDOG;
    return REG(CHIP_RESET) & CHIP_RESET_RUN ? BOARD_START_PIN : BOARD_START_POWER;
}

enum board_start board_init(void)
{
    const uint32_t wanted = RESET_IO | RESET_PADS | RESET_PLLS | RESET_SPI | RESET_TIMER | RESET_USB;
    const enum board_start cause = board_cause();
    CLEAR(RESETS) = RESET_PLLS;
    board_clocks();
    CLEAR(RESETS) = wanted;
    while ((REG(RESETS_DONE) & wanted) != wanted) {
    }
    board_pins();
    REG(TIMER_INTE) = 1; /* alarm 0 */
    REG(PSM_WDSEL) = PSM_ALL_BUT_OSCILLATORS;
    board_alive();
    REG(WATCHDOG_CTRL) = WATCHDOG_ON;
    return cause;
}

static uint32_t board_selects(const uint8_t lanes[BOARD_BUSES])
{
    return (lanes[0] < BOARD_LANES ? 1u << PIN_SELECT[lanes[0]] : 0u) |
           (lanes[1] < BOARD_LANES ? 1u << PIN_SELECT[lanes[1]] : 0u);
}

void board_send(const uint8_t lanes[BOARD_BUSES], const uint16_t *words, uint32_t n, bool in_mode_3)
{
    if (mode_3 != in_mode_3)
        board_set_mode(in_mode_3);
    REG(SIO_OUT_CLEAR) = board_selects(lanes);
    for (uint32_t i = 0; i < n; i++) {
        if (lanes[0] < BOARD_LANES)
            REG(SPI(0) + SPI_DR) = words[i];
        if (lanes[1] < BOARD_LANES)
            REG(SPI(1) + SPI_DR) = words[i];
    }
}

void board_receive(const uint8_t lanes[BOARD_BUSES], uint32_t n, uint16_t answers[BOARD_BUSES][BOARD_TRANSFER_MAX])
{
    while ((REG(SPI(0) + SPI_SR) | REG(SPI(1) + SPI_SR)) & SPI_BUSY) {
    }
    REG(SIO_OUT_SET) = board_selects(lanes);
    for (uint32_t i = 0; i < n; i++) {
        answers[0][i] = (uint16_t)REG(SPI(0) + SPI_DR);
        answers[1][i] = (uint16_t)REG(SPI(1) + SPI_DR);
    }
}

void board_ask(uint8_t lane, uint16_t words[BOARD_TRANSFER_MAX], uint32_t n, bool in_mode_3)
{
    uint8_t lanes[BOARD_BUSES] = {BOARD_LANE_NONE, BOARD_LANE_NONE};
    uint16_t answers[BOARD_BUSES][BOARD_TRANSFER_MAX];
    lanes[lane % BOARD_BUSES] = lane;
    board_send(lanes, words, n, in_mode_3);
    board_receive(lanes, n, answers);
    for (uint32_t i = 0; i < n; i++)
        words[i] = answers[lane % BOARD_BUSES][i];
}

void board_convert(void)
{
    REG(SIO_OUT_CLEAR) = 1u << PIN_CONVERT;
    for (uint32_t i = 0; i < CONVERT_NOPS; i++)
        __asm volatile("nop");
    REG(SIO_OUT_SET) = 1u << PIN_CONVERT;
}

uint32_t board_now(void)
{
    return REG(TIMER_NOW);
}

void board_lamp(bool on)
{
    REG(on ? SIO_OUT_SET : SIO_OUT_CLEAR) = 1u << PIN_LAMP;
}

void board_alive(void)
{
    REG(WATCHDOG_LOAD) = WATCHDOG_US;
}

/* All bytes go into the FIFO faster than they leave it, so that the flash stays selected throughout. */
uint64_t board_number(void)
{
    uint64_t number = 0;
    REG(SSI_SSIENR) = 0;
    REG(SSI_CTRLR0) = 7u << 16; /* eight bits, both ways */
    REG(SSI_SER) = 1;
    REG(SSI_SSIENR) = 1;
    for (uint32_t i = 0; i < FLASH_UNIQUE_BYTES; i++)
        REG(SSI_DR0) = i == 0 ? FLASH_UNIQUE_ID : 0;
    while (REG(SSI_RXFLR) < FLASH_UNIQUE_BYTES) {
    }
    for (uint32_t i = 0; i < FLASH_UNIQUE_BYTES; i++) /* the first five are shifted out again */
        number = number << 8 | (uint8_t)REG(SSI_DR0);
    REG(SSI_SSIENR) = 0;
    return number;
}

/* The ROM's table of functions: found by two letters, as its documentation gives them (data sheet, 2.8.3). */
void board_boot_drive(void)
{
    typedef void *(*lookup)(const uint16_t *table, uint32_t code);
    typedef void (*reset_usb_boot)(uint32_t lamp_pins, uint32_t interfaces_off);
    const uint32_t table = REG(ROM_FUNCTIONS) & UINT16_MAX;
    const lookup look_up = (lookup)(uintptr_t)(REG(ROM_LOOK_UP) & UINT16_MAX);
    const uint32_t code = (uint32_t)'U' | (uint32_t)'B' << 8;
    ((reset_usb_boot)look_up((const uint16_t *)(uintptr_t)table, code))(1u << PIN_LAMP, 0);
}

void board_fault(void)
{
    REG(WATCHDOG_SCRATCH0) = FAULT_MARK;
    REG(WATCHDOG_CTRL) = WATCHDOG_FIRE;
    for (;;) {
    }
}
