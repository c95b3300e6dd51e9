/* Timers 1 to 3 as free-running counters with a period. */
#include "dspic_chip.h"

static const uint16_t CONTROL[] = {T1CON, T2CON, T3CON}, COUNT[] = {TMR1, TMR2, TMR3}, PERIOD[] = {PR1, PR2, PR3};
static const uint8_t NUMBER[] = {IRQ_T1, IRQ_T2, IRQ_T3};
static const uint16_t PRESCALE[] = {1, 8, 64, 256};

static bool on(const struct dspic *chip, unsigned n)
{
    return chip->sfr[CONTROL[n] / 2u] & TCON_TON;
}

static uint64_t count_fs(const struct dspic *chip, unsigned n)
{
    return PRESCALE[chip->sfr[CONTROL[n] / 2u] >> TCON_TCKPS_SHIFT & 3u] * chip->cycle_fs;
}

/* With a period of 0 it stays at 0 (A). */
static bool runs(const struct dspic *chip, unsigned n)
{
    return on(chip, n) && (chip->sfr[PERIOD[n] / 2u] > 0 || chip->timer[n].from > 0);
}

uint16_t timer_count(const struct dspic *chip, unsigned n)
{
    const struct timer *t = &chip->timer[n];
    const uint64_t counts = runs(chip, n) ? (chip->now_fs - t->since_fs) / count_fs(chip, n) : 0;
    return (uint16_t)(t->from + counts);
}

/* The count equals the period, then begins again at 0: the flag is set with the next count. */
static void plan(struct dspic *chip, unsigned n)
{
    struct timer *t = &chip->timer[n];
    const uint32_t counts = (uint32_t)(uint16_t)(*sfr(chip, PERIOD[n]) - t->from) + 1u;
    plan_event(chip, EVENT_T1 + n, runs(chip, n) ? t->since_fs + counts * count_fs(chip, n) : NEVER);
}

void timer_event(struct dspic *chip, unsigned n)
{
    chip->timer[n] = (struct timer){.since_fs = chip->now_fs};
    plan(chip, n);
    irq_raise(chip, NUMBER[n]);
}

/* Keeps the count over a change of its control register. The prescaler begins anew when TMRx is written or TON cleared,
 * not when TxCON is written otherwise (A). */
static void hold(struct dspic *chip, unsigned n, uint16_t old)
{
    uint16_t *control = sfr(chip, CONTROL[n]);
    const uint16_t now = *control;
    *control = old;
    const uint16_t count = timer_count(chip, n);
    *control = now;
    chip->timer[n] = (struct timer){.since_fs = chip->now_fs, .from = count};
}

/* A new period is compared from now on: one that the count has passed is met only after the count's overflow. The
 * prescaler goes on. */
static void compare_anew(struct dspic *chip, unsigned n, uint16_t old)
{
    struct timer *t = &chip->timer[n];
    if (old == 0 && t->from == 0)
        t->since_fs = chip->now_fs; /* it stood still */
    const uint16_t count = timer_count(chip, n);
    t->since_fs += (uint16_t)(count - t->from) * count_fs(chip, n);
    t->from = count;
}

void timer_wrote(struct dspic *chip, unsigned address, uint16_t old)
{
    for (unsigned n = 0; n < 3u; n++) {
        if (address == COUNT[n])
            chip->timer[n] = (struct timer){.since_fs = chip->now_fs, .from = *sfr(chip, address)};
        else if (address == CONTROL[n] && *sfr(chip, address) != old)
            hold(chip, n, old);
        else if (address == PERIOD[n] && on(chip, n))
            compare_anew(chip, n, old);
        else if (address != CONTROL[n] && address != PERIOD[n])
            continue;
        plan(chip, n);
    }
}

void timers_rescale(struct dspic *chip, uint64_t old_cycle_fs)
{
    const uint64_t new_cycle_fs = chip->cycle_fs;
    for (unsigned n = 0; n < 3u; n++) {
        chip->cycle_fs = old_cycle_fs;
        hold(chip, n, *sfr(chip, CONTROL[n]));
        chip->cycle_fs = new_cycle_fs;
        plan(chip, n);
    }
}
