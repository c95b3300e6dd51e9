/* Interrupt controller: flags, enables, priorities, nesting. */
#include "dspic_chip.h"

static unsigned dspic_interrupts_priority(const struct dspic *chip, unsigned irq)
{
    return (unsigned)chip->sfr[(IPC0 / 2u) + irq / 4u] >> (4u * (irq % 4u)) & 7u;
}

/* The flagged and enabled interrupt of the highest priority, the lowest number among equals; IRQ_COUNT: none. */
static unsigned dspic_interrupts_best(const struct dspic *chip, unsigned *its_priority)
{
    unsigned found = IRQ_COUNT;
    *its_priority = 0;
    for (unsigned word = 0; word * 16u < IRQ_COUNT; word++) {
        unsigned ready = (unsigned)chip->sfr[IFS0 / 2u + word] & chip->sfr[IEC0 / 2u + word];
        for (unsigned bit = 0; ready != 0; bit++, ready >>= 1) {
            const unsigned irq = 16u * word + bit;
            if ((ready & 1u) && dspic_interrupts_priority(chip, irq) > *its_priority) {
                *its_priority = dspic_interrupts_priority(chip, irq);
                found = irq;
            }
        }
    }
    return found;
}

static unsigned dspic_interrupts_threshold(const struct dspic *chip)
{
    const unsigned masked = (unsigned)chip->sfr[SR / 2u] >> SR_IPL_SHIFT & 7u;
    const bool nests = !(chip->sfr[INTCON1 / 2u] & INTCON1_NSTDIS);
    const unsigned held = chip->now_fs < chip->held_fs ? 6u : 0u; /* DISI leaves the highest priority alone */
    if (chip->level > 0 && !nests)
        return 7u;
    return chip->level > masked ? (chip->level > held ? chip->level : held) : masked > held ? masked : held;
}

void dspic_irq_raise(struct dspic *chip, unsigned irq)
{
    *dspic_chip_sfr(chip, IFS0 + 2u * (irq / 16u)) |= (uint16_t)(1u << irq % 16u);
    chip->look = true;
    dma_request(chip, irq);
}

static void dspic_interrupts_serve(struct dspic *chip, unsigned irq, unsigned its)
{
    const unsigned before = chip->level;
    const uint64_t since = chip->now_fs;
    chip->level = its;
    system_wake(chip);
    chip->interrupts++;
    dspic_spend(chip, chip->parameters.entry_cycles);
    chip->wiring.interrupt(chip->wiring.context, irq);
    dspic_spend(chip, chip->parameters.exit_cycles);
    chip->level = before;
    chip->look = true; /* what had to wait for this priority */
    if (before == 0)
        chip->busy_fs += chip->now_fs - since;
}

void dspic_irq_take(struct dspic *chip)
{
    unsigned its;
    bool woke = false;
    if (!chip->look || chip->hung)
        return;
    chip->look = false;
    for (unsigned irq = dspic_interrupts_best(chip, &its); irq < IRQ_COUNT && its > dspic_interrupts_threshold(chip);
         irq = dspic_interrupts_best(chip, &its)) {
        dspic_interrupts_serve(chip, irq, its);
        woke = true;
    }
    if (chip->idle && its > 0) { /* not above the CPU's priority: it wakes and goes on, the interrupt waits (A) */
        system_wake(chip);
        woke = true;
    }
    if (woke && chip->level == 0 && !chip->in_start)
        chip->wiring.loop(chip->wiring.context);
}

void dspic_hold_interrupts(struct dspic *chip, uint16_t cycles)
{
    dspic_spend(chip, 1u);
    chip->held_fs = chip->now_fs + cycles * chip->cycle_fs;
    dspic_plan_event(chip, EVENT_DISI, chip->held_fs);
}
