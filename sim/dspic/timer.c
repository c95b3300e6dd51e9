/* Timers 1 to 3 as free-running counters with a period. */
#include "dspic_chip.h"

static const uint16_t CONTROL[] = {T1CON, T2CON, T3CON}, COUNT[] = {TMR1, TMR2, TMR3}, PERIOD[] = {PR1, PR2, PR3};
static const uint8_t NUMBER[] = {IRQ_T1, IRQ_T2, IRQ_T3};
static const uint16_t PRESCALE[] = {1, 8, 64, 256};

static bool dspic_timer_on(const struct dspic *chip, unsigned n)
{
    return chip->sfr[CONTROL[n] / 2u] & TCON_TON;
}

static uint64_t dspic_timer_count_fs(const struct dspic *chip, unsigned n)
{
    return PRESCALE[chip->sfr[CONTROL[n] / 2u] >> TCON_TCKPS_SHIFT & 3u] * chip->cycle_fs;
}

/* A timer with a period of 0 stays at 0 (A). */
static bool dspic_timer_runs(const struct dspic *chip, unsigned n)
{
    return dspic_timer_on(chip, n) && (chip->sfr[PERIOD[n] / 2u] > 0 || chip->timer[n].from > 0);
}

uint16_t timer_count(const struct dspic *chip, unsigned n)
{
    const struct timer *t = &chip->timer[n];
    const uint64_t counts =
        dspic_timer_runs(chip, n) ? (chip->now_fs - t->since_fs) / dspic_timer_count_fs(chip, n) : 0;
    return (uint16_t)(t->from + counts);
}

/* The count equals the period, then begins again at 0: the flag is set with the next count. */
static void dspic_timer_plan(struct dspic *chip, unsigned n)
{
    struct timer *t = &chip->timer[n];
    const uint32_t counts = (uint32_t)(uint16_t)(*dspic_chip_sfr(chip, PERIOD[n]) - t->from) + 1u;
    dspic_plan_event(chip, EVENT_T1 + n,
                     dspic_timer_runs(chip, n) ? t->since_fs + counts * dspic_timer_count_fs(chip, n) : NEVER);
}

void timer_event(struct dspic *chip, unsigned n)
{
    chip->timer[n] = (struct timer){.since_fs = chip->now_fs};
    dspic_timer_plan(chip, n);
    dspic_irq_raise(chip, NUMBER[n]);
}

/* Keeps the count over a change of its control register. The prescaler begins anew when TMRx is written or TON cleared,
 * not when TxCON is written otherwise (A). */
static void dspic_timer_hold(struct dspic *chip, unsigned n, uint16_t old)
{
    uint16_t *control = dspic_chip_sfr(chip, CONTROL[n]);
    const uint16_t now = *control;
    *control = old;
    const uint16_t count = timer_count(chip, n);
    *control = now;
    chip->timer[n] = (struct timer){.since_fs = chip->now_fs, .from = count};
}

/* A new period is compared from now on: one that the count has passed is met only after the count's overflow. The
 * prescaler goes on. */
static void dspic_timer_compare_anew(struct dspic *chip, unsigned n, uint16_t old)
{
    struct timer *t = &chip->timer[n];
    if (old == 0 && t->from == 0)
        t->since_fs = chip->now_fs; /* it stood still */
    const uint16_t count = timer_count(chip, n);
    t->since_fs += (uint16_t)(count - t->from) * dspic_timer_count_fs(chip, n);
    t->from = count;
}

void timer_wrote(struct dspic *chip, unsigned address, uint16_t old)
{
    for (unsigned n = 0; n < 3u; n++) {
        if (address == COUNT[n])
            chip->timer[n] = (struct timer){.since_fs = chip->now_fs, .from = *dspic_chip_sfr(chip, address)};
        else if (address == CONTROL[n] && *dspic_chip_sfr(chip, address) != old)
            dspic_timer_hold(chip, n, old);
        else if (address == PERIOD[n] && dspic_timer_on(chip, n))
            dspic_timer_compare_anew(chip, n, old);
        else if (address != CONTROL[n] && address != PERIOD[n])
            continue;
        dspic_timer_plan(chip, n);
    }
}

void timers_rescale(struct dspic *chip, uint64_t old_cycle_fs)
{
    const uint64_t new_cycle_fs = chip->cycle_fs;
    for (unsigned n = 0; n < 3u; n++) {
        chip->cycle_fs = old_cycle_fs;
        dspic_timer_hold(chip, n, *dspic_chip_sfr(chip, CONTROL[n]));
        chip->cycle_fs = new_cycle_fs;
        dspic_timer_plan(chip, n);
    }
}
