/* Events and time: what happens by itself, in its order. */
#include "dspic_chip.h"

void dspic_plan_event(struct dspic *chip, enum event event, uint64_t at_fs)
{
    chip->due_fs[event] = at_fs;
    if (at_fs < chip->soon_fs)
        chip->soon_fs = at_fs;
}

static enum event dspic_events_next_event(const struct dspic *chip)
{
    enum event next = EVENT_SPI1;
    for (enum event e = EVENT_SPI1; e < EVENTS; e++) {
        if (chip->due_fs[e] < chip->due_fs[next])
            next = e;
    }
    return next;
}

void event_handle(struct dspic *chip, enum event event)
{
    chip->due_fs[event] = NEVER;
    switch (event) {
    case EVENT_SPI1:
    case EVENT_SPI2:
        spi_event(chip, event - EVENT_SPI1);
        break;
    case EVENT_T1:
    case EVENT_T2:
    case EVENT_T3:
        timer_event(chip, event - EVENT_T1);
        break;
    case EVENT_DMA:
        dma_event(chip);
        break;
    case EVENT_PLL:
        system_pll_event(chip);
        break;
    case EVENT_DISI:
        chip->look = true;
        break;
    case EVENT_WATCHDOG:
        dspic_watchdog_event(chip);
        break;
    case EVENT_POWER:
        dspic_chip_throw_out(chip, 0);
        break;
    case EVENT_OUTSIDE:
        chip->wiring.outside(chip->wiring.context);
        break;
    default:
        break;
    }
}

void events_pass(struct dspic *chip, uint64_t until_fs)
{
    while (chip->soon_fs <= until_fs) {
        const enum event e = dspic_events_next_event(chip);
        chip->soon_fs = chip->due_fs[e];
        if (chip->soon_fs > until_fs)
            break;
        if (chip->soon_fs > chip->now_fs)
            chip->now_fs = chip->soon_fs;
        event_handle(chip, e);
    }
    if (until_fs > chip->now_fs)
        chip->now_fs = until_fs;
}

void dspic_stall(struct dspic *chip, uint64_t until_fs)
{
    events_pass(chip, until_fs);
}

void dspic_spend(struct dspic *chip, uint64_t cycles)
{
    events_pass(chip, chip->now_fs + cycles * chip->cycle_fs);
    dspic_irq_take(chip);
}

void dspic_compute(struct dspic *chip, uint64_t cycles)
{
    dspic_spend(chip, cycles);
}

void dspic_compute_until(struct dspic *chip, uint64_t cycles, uint16_t address)
{
    chip->computed_fs = chip->now_fs + cycles * chip->cycle_fs;
    chip->computed_for = address;
}

uint64_t dspic_cycle_fs(const struct dspic *chip)
{
    return chip->cycle_fs;
}

void dspic_outside_at(struct dspic *chip, uint64_t at_fs)
{
    dspic_plan_event(chip, EVENT_OUTSIDE, at_fs);
}

uint64_t dspic_now_fs(const struct dspic *chip)
{
    return chip->now_fs;
}

uint64_t dspic_next_fs(const struct dspic *chip)
{
    return chip->due_fs[dspic_events_next_event(chip)];
}

bool dspic_rests(const struct dspic *chip)
{
    bool rests = chip->powered && chip->idle && !chip->hung && chip->level == 0 && chip->requested == 0;
    for (enum event e = EVENT_SPI1; e < EVENTS; e++)
        rests &= e == EVENT_T3 || e == EVENT_WATCHDOG || chip->due_fs[e] == NEVER;
    for (unsigned word = 0; word * 16u < IRQ_COUNT; word++)
        rests &= !(chip->sfr[IFS0 / 2u + word] & chip->sfr[IEC0 / 2u + word]);
    return rests;
}

void dspic_skip(struct dspic *chip, uint64_t fs)
{
    chip->now_fs += fs;
    chip->soon_fs += chip->soon_fs == NEVER ? 0 : fs;
    for (enum event e = EVENT_SPI1; e < EVENTS; e++)
        chip->due_fs[e] += chip->due_fs[e] == NEVER ? 0 : fs;
    for (unsigned n = 0; n < sizeof chip->timer / sizeof *chip->timer; n++)
        chip->timer[n].since_fs += fs;
}

void dspic_cut_power_at(struct dspic *chip, uint64_t at_fs)
{
    dspic_plan_event(chip, EVENT_POWER, at_fs);
}
