/* The drivers on the register model where the bus goes on and the CPU does not: a page erase, a PLL that does not lock.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "orders.h"
#include "sim_node_state.h"

#define US (1000u * DSPIC_FS_PER_NS)
#define TICK (500u * US)

/* What the bus does within a tick, each at its time: select, four words, deselect. Edges of a word take no time here.
 */
enum { SYNC, SELECT, WORD_0, DESELECT = WORD_0 + 4, STEPS };
static const uint64_t AT[STEPS] = {0, 3u * US, 5u * US, 12u * US, 19u * US, 26u * US, 33u * US};

struct bus {
    sim_node *node;
    uint64_t begin_fs;
    unsigned tick, step;
    uint8_t order[WHISKER_ORDER_BYTES], record[WHISKER_RECORD_BYTES];
    unsigned good, bad; /* records in a row, of the loader's, with the tick before */
    unsigned worst;     /* most bad ones in a row */
};

static void judge(struct bus *bus)
{
    const uint8_t *r = bus->record;
    const bool good = whisker_crc8(r, WHISKER_RECORD_CRC) == r[WHISKER_RECORD_CRC] &&
                      r[WHISKER_RECORD_TICK] == (uint8_t)(bus->tick - 1u) &&
                      whisker_get_u16(r + WHISKER_RECORD_STATUS) >> WHISKER_STATUS_CODE_SHIFT == WHISKER_CODE_LOADER;
    bus->good = good ? bus->good + 1u : 0u;
    bus->bad = good ? 0u : bus->bad + 1u;
    bus->worst = bus->bad > bus->worst ? bus->bad : bus->worst;
}

static void clock_word(struct bus *bus, unsigned word)
{
    const uint64_t now = sim_node_fs(bus->node);
    for (unsigned bit = 16u * word; bit < 16u * word + 16u; bit++) {
        const unsigned mask = 0x80u >> bit % 8u;
        sim_node_pin(bus->node, SIM_NODE_MOSI, bus->order[bit / 8u] & mask, now);
        sim_node_pin(bus->node, SIM_NODE_SCK, true, now);
        bus->record[bit / 8u] = (uint8_t)((bus->record[bit / 8u] & ~mask) | (sim_node_miso(bus->node) ? mask : 0u));
        sim_node_pin(bus->node, SIM_NODE_SCK, false, now);
    }
}

static void begin_tick(struct bus *bus)
{
    bus->tick++;
    bus->begin_fs = sim_node_fs(bus->node);
    bus->order[WHISKER_ORDER_TICK] = (uint8_t)bus->tick;
    bus->order[WHISKER_ORDER_COMMAND] = WHISKER_COMMAND_SAMPLE;
    bus->order[WHISKER_ORDER_CRC] = whisker_crc8(bus->order, WHISKER_ORDER_CRC);
    sim_node_pin(bus->node, SIM_NODE_SYNC, true, bus->begin_fs);
    sim_node_pin(bus->node, SIM_NODE_SYNC, false, bus->begin_fs);
}

static void act(void *context)
{
    struct bus *bus = context;
    const unsigned step = bus->step;
    if (step == SYNC)
        begin_tick(bus);
    else if (step == SELECT || step == DESELECT)
        sim_node_pin(bus->node, SIM_NODE_SELECT, step == DESELECT, sim_node_fs(bus->node));
    else
        clock_word(bus, step - WORD_0);
    if (step == DESELECT)
        judge(bus);
    bus->step = (step + 1u) % STEPS;
    sim_node_plan(bus->node, bus->begin_fs + (bus->step == SYNC ? TICK : AT[bus->step]));
}

static void pass(struct bus *bus, unsigned ticks)
{
    sim_node_until(bus->node, sim_node_fs(bus->node) + ticks * TICK);
}

/* A node without an application, its loader's bus running; `header`: of the application it has lost. */
static void begin_without_application(struct bus *bus, const struct sim_node_parameters *parameters,
                                      uint8_t header[WHISKER_IMAGE_HEADER_BYTES])
{
    *bus = (struct bus){.node = sim_node_new_as(parameters)};
    assert_non_null(bus->node);
    const uint32_t *word = dspic_flash(bus->node->chip) + WHISKER_LIMIT_APPLICATION_ROW * FLASH_ROW_WORDS;
    for (unsigned i = 0; i < WHISKER_IMAGE_HEADER_BYTES; i++)
        header[i] = (uint8_t)(word[i / 3u] >> 8u * (i % 3u) & 0xFFu);
    sim_node_program(bus->node, NULL, 0);
    sim_node_power_on(bus->node);
    sim_node_pin(bus->node, SIM_NODE_SELECT, true, sim_node_fs(bus->node));
    sim_node_outside(bus->node, act, bus);
    sim_node_plan(bus->node, sim_node_fs(bus->node) + 100u * US);
    pass(bus, 10);
}

/* A service order as its window would have brought it. */
static void order(struct bus *bus, uint8_t command, const uint8_t data[SERVICE_BLOCK_BYTES])
{
    uint8_t bytes[WHISKER_SERVICE_BYTES];
    uint16_t words[SERVICE_WORDS];
    order_of(bytes, (uint8_t)bus->tick, command, 0, data);
    words_of(bytes, words);
    node_on_service(&bus->node->board.node, words);
}

/* The erase holds the CPU for 46 ticks; its first transfer ends the DMA's blocks, what follows fills the slave and
 * overflows it. Whatever is pending afterwards, two ticks later the records are right again. */
static void a_slave_that_overflowed_in_a_page_erase_recovers(void **state)
{
    (void)state;
    struct bus bus;
    uint8_t header[WHISKER_IMAGE_HEADER_BYTES];
    struct sim_node_parameters parameters;
    sim_node_parameters_default(&parameters, 1);
    begin_without_application(&bus, &parameters, header);
    const struct node *node = &bus.node->board.node;
    assert_true(bus.good >= 5u);
    assert_int_equal(node->health[WHISKER_HEALTH_LINK_OVERFLOW], 0);
    bus.worst = 0;
    order(&bus, WHISKER_SERVICE_COMMAND_BEGIN, header);
    pass(&bus, 60);
    assert_int_equal(bus.node->board.loader.state, WHISKER_NODE_STATE_LOADING);
    assert_int_equal(node->health[WHISKER_HEALTH_LINK_OVERFLOW], 1);
    assert_in_range(bus.worst, 44, 48);
    assert_true(bus.good >= 10u);
    assert_int_equal(sim_node_violations(bus.node), 0);
    sim_node_free(bus.node);
}

/* Whether a preloaded word then waits in the buffer or is taken out of it at once, which reads alike as "not taken". */
static void a_first_word_that_the_slave_ignores_is_written_again(void **state)
{
    (void)state;
    for (uint8_t prefetch = 1; prefetch <= 2u; prefetch++) {
        struct bus bus;
        uint8_t header[WHISKER_IMAGE_HEADER_BYTES];
        struct sim_node_parameters parameters;
        sim_node_parameters_default(&parameters, 1);
        parameters.chip.slave_prefetch = prefetch;
        parameters.chip.spi_deaf_cycles = 4;
        begin_without_application(&bus, &parameters, header);
        bus.worst = 0;
        pass(&bus, 20);
        assert_int_equal(bus.worst, 0);
        assert_int_equal(sim_node_violations(bus.node), 0);
        sim_node_free(bus.node);
    }
}

static void a_pll_that_does_not_lock_is_tried_again(void **state)
{
    (void)state;
    struct sim_node_parameters parameters;
    sim_node_parameters_default(&parameters, 1);
    parameters.chip.pll_failures = 3;
    sim_node *node = sim_node_new_as(&parameters);
    assert_non_null(node);
    sim_node_cut(node, 2000000000u); /* a firmware that waits for ever would keep this test from ending */
    sim_node_power_on(node);
    assert_false(sim_node_dark(node));
    assert_true(dspic_fcy_hz(node->chip) > 37000000u);
    assert_in_range(sim_node_fs(node) / (1000u * US), 3u * parameters.chip.watchdog_ms,
                    3u * parameters.chip.watchdog_ms + 40u);
    sim_node_free(node);
}

struct warm {
    sim_node *node;
    bool watched; /* the watchdog runs while the loader still checks the application */
};

static void look(void *context)
{
    struct warm *warm = context;
    warm->watched = dspic_sfr_read(warm->node->chip, RCON) & RCON_SWDTEN;
}

static void be_warm(bool keeps_clock, uint16_t cause)
{
    struct sim_node_parameters parameters;
    sim_node_parameters_default(&parameters, 1);
    parameters.chip.keeps_clock = keeps_clock;
    struct warm warm = {.node = sim_node_new_as(&parameters)};
    assert_non_null(warm.node);
    sim_node_power_on(warm.node);
    const uint32_t fcy_hz = dspic_fcy_hz(warm.node->chip);
    sim_node_outside(warm.node, look, &warm);
    sim_node_plan(warm.node, sim_node_fs(warm.node) + 200u * US);
    sim_node_disturb(warm.node, SIM_NODE_RESET, cause);
    sim_node_until(warm.node, sim_node_fs(warm.node) + 30000u * US);
    assert_true(node_ready(&warm.node->board.node));
    assert_int_equal(dspic_fcy_hz(warm.node->chip), fcy_hz);
    assert_true(warm.watched);
    assert_int_equal(sim_node_violations(warm.node), 0);
    sim_node_free(warm.node);
}

/* Whether the chip goes on with its PLL, whose divisors are then those of reset, or begins with the plain oscillator.
 */
static void every_reset_ends_at_the_same_clock(void **state)
{
    (void)state;
    static const uint16_t CAUSES[] = {RCON_EXTR, RCON_SWR, RCON_WDTO, RCON_TRAPR, RCON_IOPUWR, RCON_BOR};
    for (unsigned i = 0; i < sizeof CAUSES / sizeof *CAUSES; i++) {
        be_warm(true, CAUSES[i]);
        be_warm(false, CAUSES[i]);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_slave_that_overflowed_in_a_page_erase_recovers),
        cmocka_unit_test(a_first_word_that_the_slave_ignores_is_written_again),
        cmocka_unit_test(a_pll_that_does_not_lock_is_tried_again),
        cmocka_unit_test(every_reset_ends_at_the_same_clock),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
