/* SPI1 and SPI2: one receive and one transmit buffer each, no FIFO; standard mode, 8 or 16 bits, master or slave. */
#include "dspic_chip.h"

enum { STAT = SPI1STAT, CON1 = SPI1CON1, BUF = SPI1BUF, OFFSET = SPI2STAT - SPI1STAT };

static const uint8_t DONE_IRQ[] = {IRQ_SPI1, IRQ_SPI2}, ERROR_IRQ[] = {IRQ_SPI1_ERROR, IRQ_SPI2_ERROR};

static uint16_t *dspic_spi_reg(struct dspic *chip, unsigned n, unsigned address)
{
    return dspic_chip_sfr(chip, address + n * OFFSET);
}

static uint16_t dspic_spi_con1(const struct dspic *chip, unsigned n)
{
    return chip->sfr[(CON1 + n * OFFSET) / 2u];
}

static bool dspic_spi_enabled(const struct dspic *chip, unsigned n)
{
    return chip->sfr[(STAT + n * OFFSET) / 2u] & SPISTAT_SPIEN;
}

static unsigned dspic_spi_width(const struct dspic *chip, unsigned n)
{
    return dspic_spi_con1(chip, n) & SPICON1_MODE16 ? 16u : 8u;
}

static unsigned dspic_spi_divider(uint16_t control)
{
    static const unsigned PRIMARY[] = {64, 16, 4, 1};
    const unsigned secondary = 8u - ((unsigned)control >> SPICON1_SPRE_SHIFT & 7u);
    return PRIMARY[(unsigned)control >> SPICON1_PPRE_SHIFT & 3u] * secondary;
}

/* Where a slave's /SS comes in; SPI1's is not used as one here. */
static bool dspic_spi_selected(const struct dspic *chip, unsigned n)
{
    if (!(dspic_spi_con1(chip, n) & SPICON1_SSEN))
        return true;
    return n == 1u && !pin_level(chip, pin_input_field(chip, RPINR23, 0));
}

static void dspic_spi_load(struct dspic *chip, unsigned n)
{
    struct spi *s = &chip->spi[n];
    if (*dspic_spi_reg(chip, n, STAT) & SPISTAT_SPITBF)
        s->word = s->transmit; /* else the old contents go out again */
    *dspic_spi_reg(chip, n, STAT) &= (uint16_t)~SPISTAT_SPITBF;
    s->out = (uint16_t)(s->word << (16u - dspic_spi_width(chip, n)));
    s->in = 0;
    s->bit = 0;
    s->loaded = true;
}

static void dspic_spi_begin(struct dspic *chip, unsigned n)
{
    struct spi *s = &chip->spi[n];
    dspic_spi_load(chip, n);
    s->half_fs = dspic_spi_divider(dspic_spi_con1(chip, n)) * chip->cycle_fs / 2u;
    s->shifting = true;
    s->high = false;
    dspic_plan_event(chip, EVENT_SPI1 + n, chip->now_fs + s->half_fs);
}

static void dspic_spi_shift_out(struct dspic *chip, unsigned n)
{
    struct spi *s = &chip->spi[n];
    s->sdo = s->out >> 15 & 1u;
    s->out = (uint16_t)(s->out << 1);
}

static void dspic_spi_end_word(struct dspic *chip, unsigned n)
{
    struct spi *s = &chip->spi[n];
    uint16_t *stat = dspic_spi_reg(chip, n, STAT);
    s->loaded = false;
    s->bit = 0;
    if (*stat & (SPISTAT_SPIRBF | SPISTAT_SPIROV)) { /* the word is lost, and all later ones until SPIROV is cleared */
        if (!(*stat & SPISTAT_SPIROV)) {
            *stat |= SPISTAT_SPIROV;
            dspic_irq_raise(chip, ERROR_IRQ[n]);
        }
    } else {
        s->receive = s->in;
        *stat |= SPISTAT_SPIRBF;
    }
    dspic_irq_raise(chip, DONE_IRQ[n]);
}

static void dspic_spi_sample(struct dspic *chip, unsigned n)
{
    struct spi *s = &chip->spi[n];
    const unsigned field = pin_input_field(chip, n == 0 ? RPINR20 : RPINR22, 0);
    s->in = (uint16_t)(s->in << 1 | pin_level(chip, field));
    s->bit++;
}

/* Master: SCK rises and the bit goes out, SCK falls and the bit comes in (CKP 0, CKE 0, SMP 0: SPI mode 1). */
void spi_event(struct dspic *chip, unsigned n)
{
    struct spi *s = &chip->spi[n];
    s->high = !s->high;
    if (s->high)
        dspic_spi_shift_out(chip, n);
    pins_of_spi(chip, n);
    if (!s->high)
        dspic_spi_sample(chip, n);
    if (s->bit < dspic_spi_width(chip, n) || s->high) {
        dspic_plan_event(chip, EVENT_SPI1 + n, chip->now_fs + s->half_fs);
        return;
    }
    s->shifting = false;
    dspic_spi_end_word(chip, n);
    if (*dspic_spi_reg(chip, n, STAT) & SPISTAT_SPITBF && !s->shifting)
        dspic_spi_begin(chip, n);
}

/* The last edge was the word's last one. */
static void dspic_spi_end_slave_word(struct dspic *chip, unsigned n)
{
    dspic_spi_end_word(chip, n);
    if (chip->parameters.slave_prefetch > 1u && *dspic_spi_reg(chip, n, STAT) & SPISTAT_SPITBF && !chip->spi[n].loaded)
        dspic_spi_load(chip, n);
}

static void dspic_spi_slave_edge(struct dspic *chip, unsigned n, bool level)
{
    struct spi *s = &chip->spi[n];
    if (level == s->high || !dspic_spi_selected(chip, n))
        return;
    s->high = level;
    if (level) {
        if (!s->loaded)
            dspic_spi_load(chip, n);
        dspic_spi_shift_out(chip, n);
        pins_of_spi(chip, n);
        return;
    }
    dspic_spi_sample(chip, n);
    if (s->bit == dspic_spi_width(chip, n))
        dspic_spi_end_slave_word(chip, n);
}

/* /SS: a word cut short begins again at its first bit. */
static void dspic_spi_select_edge(struct dspic *chip, unsigned n)
{
    struct spi *s = &chip->spi[n];
    if (s->loaded && s->bit > 0) {
        s->out = (uint16_t)(s->word << (16u - dspic_spi_width(chip, n)));
        s->in = 0;
        s->bit = 0;
    }
    s->high = false;
    s->sdo = false;
    pins_of_spi(chip, n);
}

void spi_input(struct dspic *chip, unsigned rp, bool level)
{
    for (unsigned n = 0; n < 2u; n++) {
        if (!dspic_spi_enabled(chip, n) || dspic_spi_con1(chip, n) & SPICON1_MSTEN)
            continue;
        if (n == 1u && dspic_spi_con1(chip, n) & SPICON1_SSEN && pin_input_field(chip, RPINR23, 0) == rp)
            dspic_spi_select_edge(chip, n);
        if (pin_input_field(chip, n == 0 ? RPINR20 : RPINR22, 8u) == rp)
            dspic_spi_slave_edge(chip, n, level);
    }
}

uint16_t spi_read_buffer(struct dspic *chip, unsigned n)
{
    *dspic_spi_reg(chip, n, STAT) &= (uint16_t)~SPISTAT_SPIRBF;
    return chip->spi[n].receive;
}

static void dspic_spi_write_buffer(struct dspic *chip, unsigned n, uint16_t value)
{
    struct spi *s = &chip->spi[n];
    if (!dspic_spi_enabled(chip, n)) {
        chip->violations.spi_disabled++;
        return;
    }
    if (chip->now_fs - s->enabled_fs < chip->parameters.spi_deaf_cycles * chip->cycle_fs)
        return;
    if (*dspic_spi_reg(chip, n, STAT) & SPISTAT_SPITBF)
        chip->violations.spi_overwrite++;
    s->transmit = value;
    *dspic_spi_reg(chip, n, STAT) |= SPISTAT_SPITBF;
    if (dspic_spi_con1(chip, n) & SPICON1_MSTEN) {
        if (!s->shifting)
            dspic_spi_begin(chip, n);
    } else if (chip->parameters.slave_prefetch > 1u && !s->loaded) {
        dspic_spi_load(chip, n);
    }
}

/* Only SPIROV (cleared) and SPIEN may be written; switching off ends what is under way and empties the buffers. */
static void dspic_spi_write_status(struct dspic *chip, unsigned n, uint16_t old)
{
    uint16_t *stat = dspic_spi_reg(chip, n, STAT);
    const uint16_t keep = old & (SPISTAT_SPIRBF | SPISTAT_SPITBF);
    const uint16_t overflow = *stat & old & SPISTAT_SPIROV;
    const uint16_t enable = *stat & SPISTAT_SPIEN;
    *stat = (uint16_t)(enable | overflow | (enable ? keep : 0u));
    if (!enable) {
        chip->spi[n] = (struct spi){.word = chip->spi[n].word, .receive = chip->spi[n].receive};
        dspic_plan_event(chip, EVENT_SPI1 + n, NEVER);
    }
    if (enable && !(old & SPISTAT_SPIEN))
        chip->spi[n].enabled_fs = chip->now_fs;
    pins_of_spi(chip, n);
}

void spi_wrote(struct dspic *chip, unsigned n, unsigned address, uint16_t old)
{
    const unsigned at = address - n * OFFSET;
    if (at == BUF) {
        dspic_spi_write_buffer(chip, n, *dspic_chip_sfr(chip, address));
    } else if (at == STAT) {
        dspic_spi_write_status(chip, n, old);
    } else if (dspic_spi_enabled(chip, n)) {
        chip->violations.spi_settings += *dspic_chip_sfr(chip, address) != old;
        *dspic_chip_sfr(chip, address) = old;
    }
}

void spi_drives(const struct dspic *chip, unsigned function, bool *driven, bool *level)
{
    const unsigned n = function == RP_SDO2;
    const struct spi *s = &chip->spi[n];
    const bool master = dspic_spi_con1(chip, n) & SPICON1_MSTEN;
    if (!dspic_spi_enabled(chip, n) || (function != RP_SCK1 && dspic_spi_con1(chip, n) & SPICON1_DISSDO))
        return;
    *level = function == RP_SCK1 ? s->high : s->sdo;
    *driven = function == RP_SCK1 ? master : master || dspic_spi_selected(chip, n);
}
