/* Words exchanged whole, of a master and of a slave, held against the same words edge by edge. */
#include "bench.h"

enum { BY_EDGES, WHOLE, WAYS };

/* A new chip whose master begins this word; its line reads ones. */
static void begin_word(unsigned way, uint16_t word, uint16_t width)
{
    power(NULL);
    master();
    put(SPI1STAT, 0);
    put(SPI1CON1, get(SPI1CON1) | width);
    put(SPI1STAT, SPISTAT_SPIEN);
    enable(IRQ_SPI1, 4);
    bench.whole = way == WHOLE;
    bench.line = true;
    dspic_wire(bench.chip, SDI_PIN, true);
    put(SPI1BUF, word);
}

static void a_whole_word_ends_with_its_last_edge(void **state)
{
    (void)state;
    static const uint16_t WIDTHS[] = {0, SPICON1_MODE16};
    for (unsigned i = 0; i < 2; i++) {
        uint64_t served_fs[WAYS];
        uint16_t received[WAYS];
        uint32_t sent[WAYS];
        for (unsigned way = 0; way < WAYS; way++) {
            begin_word(way, 0xA5C2, WIDTHS[i]);
            pass(400u * US);
            served_fs[way] = bench.served_fs;
            received[way] = get(SPI1BUF);
            sent[way] = bench.sent;
            assert_int_equal(dspic_output(bench.chip, SDO_PIN), DSPIC_LOW);
            assert_int_equal(bench.words, way == WHOLE);
            assert_int_equal(bench.rises, way == WHOLE ? 0 : i == 0 ? 8 : 16);
        }
        assert_int_equal(served_fs[WHOLE], served_fs[BY_EDGES]);
        assert_int_equal(received[WHOLE], received[BY_EDGES]);
        assert_int_equal(sent[WHOLE], sent[BY_EDGES]);
    }
}

static void a_word_that_waited_follows_a_whole_one(void **state)
{
    (void)state;
    uint64_t served_fs[WAYS];
    for (unsigned way = 0; way < WAYS; way++) {
        begin_word(way, 0x11, 0);
        put(SPI1BUF, 0x22);
        pass(200u * US);
        get(SPI1BUF);
        pass(200u * US);
        assert_int_equal(bench.served[IRQ_SPI1], 2);
        assert_int_equal(bench.sent & 0xFFFFu, 0x1122);
        served_fs[way] = bench.served_fs;
    }
    assert_int_equal(served_fs[WHOLE], served_fs[BY_EDGES]);
}

static void edges_so_far_are_played_when_asked_for_and_the_others_follow(void **state)
{
    (void)state;
    for (unsigned at_us = 0; at_us < 139u; at_us += 3u) {
        unsigned rises[WAYS], falls[WAYS];
        uint64_t rise_fs[WAYS], served_fs[WAYS];
        for (unsigned way = 0; way < WAYS; way++) {
            begin_word(way, 0x5A, 0);
            pass(at_us * US);
            dspic_by_edges(bench.chip);
            rises[way] = bench.rises;
            falls[way] = bench.falls;
            pass(200u * US);
            rise_fs[way] = bench.rise_fs;
            served_fs[way] = bench.served_fs;
            assert_int_equal(bench.rises, 8);
            assert_int_equal(get(SPI1BUF), 0xFF);
            assert_int_equal(bench.words, 0);
        }
        assert_int_equal(rises[WHOLE], rises[BY_EDGES]);
        assert_int_equal(falls[WHOLE], falls[BY_EDGES]);
        assert_int_equal(rise_fs[WHOLE], rise_fs[BY_EDGES]);
        assert_int_equal(served_fs[WHOLE], served_fs[BY_EDGES]);
    }
}

enum { READ_PORT, WRITE_LATCH, WRITE_DIRECTION, WRITE_INPUTS, WRITE_OUTPUTS, SWITCH_OFF, LOSE_POWER, RESET, ACTS };

static unsigned perform(unsigned act)
{
    switch (act) {
    case READ_PORT:
        return get(PORTB);
    case WRITE_LATCH:
        set(LATB, 1u);
        return 0;
    case WRITE_DIRECTION:
        clear(TRISB, 1u);
        return 0;
    case WRITE_INPUTS: /* from here on the line reads zeros */
        put(RPINR20, 31u);
        return 0;
    case WRITE_OUTPUTS: /* the clock is on no pin any more */
        put(RPOR0 + 2u * (SCK_PIN / 2u), 0);
        return 0;
    case SWITCH_OFF:
        put(SPI1STAT, 0);
        return 0;
    case LOSE_POWER:
        dspic_power_off(bench.chip, dspic_now_fs(bench.chip));
        return 0;
    default:
        dspic_disturb_reset(bench.chip, RCON_EXTR);
        return 0;
    }
}

static void whatever_looks_at_a_word_or_breaks_it_finds_its_edges(void **state)
{
    (void)state;
    for (unsigned act = 0; act < ACTS; act++) {
        unsigned read[WAYS], rises[WAYS], falls[WAYS], received[WAYS], served[WAYS];
        for (unsigned way = 0; way < WAYS; way++) {
            begin_word(way, 0x0F, 0);
            pass(60u * US); /* after three bits and a half */
            read[way] = perform(act);
            rises[way] = bench.rises;
            falls[way] = bench.falls;
            assert_int_not_equal(rises[way], 0);
            pass(300u * US);
            served[way] = bench.served[IRQ_SPI1];
            received[way] = get(SPI1BUF);
            assert_int_equal(bench.words, 0);
        }
        assert_int_equal(read[WHOLE], read[BY_EDGES]);
        assert_int_equal(rises[WHOLE], rises[BY_EDGES]);
        assert_int_equal(falls[WHOLE], falls[BY_EDGES]);
        assert_int_equal(received[WHOLE], received[BY_EDGES]);
        assert_int_equal(served[WHOLE], served[BY_EDGES]);
    }
}

static void other_registers_leave_a_word_whole(void **state)
{
    (void)state;
    begin_word(WHOLE, 0x0F, 0);
    pass(60u * US);
    put(SPI2STAT, SPISTAT_SPIEN);
    put(TMR1, 0);
    get(SPI1STAT);
    pass(300u * US);
    assert_int_equal(bench.words, 1);
    assert_int_equal(bench.rises, 0);
}

static const struct dspic_lines LINES = {SLAVE_SCK, SLAVE_SDI, SLAVE_SDO};

static uint16_t clock_word(unsigned way, uint16_t out)
{
    uint16_t word = out;
    if (way == BY_EDGES)
        return clock_slave(out, 16);
    assert_true(dspic_input_word(bench.chip, &LINES, &word, dspic_now_fs(bench.chip)));
    return word;
}

/* Four words into a slave that is fed by hand, then by DMA, then not at all, and overflows. */
static void a_slave_takes_a_word_as_it_takes_its_edges(void **state)
{
    (void)state;
    enum { CASES = 4, WORDS = 5, SEEN = 4 };
    for (unsigned n = 0; n < CASES; n++) {
        uint16_t seen[WAYS][WORDS][SEEN];
        for (unsigned way = 0; way < WAYS; way++) {
            struct dspic_parameters parameters = standard();
            parameters.slave_prefetch = (uint8_t)(1u + n % 2u);
            parameters.dma_cycles = n / 2u ? 8 : 0;
            power(&parameters);
            slave();
            channel(0, DMACON_FROM_RAM | DMACON_MODE_ONE_SHOT, IRQ_SPI2, SPI2BUF, 2);
            channel(1, DMACON_MODE_ONE_SHOT, IRQ_SPI2, SPI2BUF, 3);
            for (unsigned i = 0; i < 40; i++)
                dspic_dma_ram(bench.chip)[i] = (uint16_t)(0x9351u + 0x1111u * i);
            put(SPI2BUF, 0xC35B);
            put(SPI2BUF, 0x3CA4); /* waits, or has taken the other's place */
            slave_select(true);
            for (unsigned i = 0; i < WORDS; i++) {
                seen[way][i][0] = clock_word(way, (uint16_t)(0x8421u + 0x0F0Fu * i));
                seen[way][i][1] = dspic_output(bench.chip, SLAVE_SDO);
                seen[way][i][2] = get(SPI2STAT);
                seen[way][i][3] = get(PORTB);
                pass(n % 2u * US);
            }
            for (unsigned i = 0; i < 3; i++)
                seen[way][i][1] ^= dspic_dma_ram(bench.chip)[32u + i];
            seen[way][0][3] ^= get(SPI2BUF);
        }
        assert_memory_equal(seen[WHOLE], seen[BY_EDGES], sizeof seen[WHOLE]);
    }
}

static bool takes_a_word(void)
{
    uint16_t word = 0;
    return dspic_input_word(bench.chip, &LINES, &word, dspic_now_fs(bench.chip));
}

static void selected_slave(void)
{
    power(NULL);
    slave();
    put(SPI2BUF, 0x1234);
    slave_select(true);
}

static void nothing_is_done_where_a_word_is_not_that_simple(void **state)
{
    (void)state;
    selected_slave();
    assert_true(takes_a_word());
    clock_slave(0, 5);
    assert_false(takes_a_word()); /* amid another */
    selected_slave();
    slave_select(false);
    assert_false(takes_a_word());
    selected_slave();
    dspic_input(bench.chip, SLAVE_SCK, true, dspic_now_fs(bench.chip));
    assert_false(takes_a_word()); /* the clock is high */
    static const uint16_t PINS[][2] = {{RPINR22, SLAVE_SDI | SDO_PIN << 8},
                                       {RPINR22, SDO_PIN | SLAVE_SCK << 8},
                                       {RPINR0, SLAVE_SCK << 8},
                                       {RPINR1, SLAVE_SCK},
                                       {RPOR0 + 2u * (SLAVE_SDO / 2u), 0}};
    for (unsigned i = 0; i < sizeof PINS / sizeof *PINS; i++) {
        selected_slave();
        put(PINS[i][0], PINS[i][1]);
        assert_false(takes_a_word());
    }
    static const uint16_t CONTROLS[] = {SPICON1_SSEN, SPICON1_MODE16 | SPICON1_SSEN | SPICON1_DISSDO,
                                        SPICON1_MODE16 | SPICON1_MSTEN};
    for (unsigned i = 0; i < sizeof CONTROLS / sizeof *CONTROLS; i++) {
        selected_slave();
        put(SPI2STAT, 0);
        put(SPI2CON1, CONTROLS[i]);
        assert_false(takes_a_word()); /* off */
        put(SPI2STAT, SPISTAT_SPIEN);
        assert_false(takes_a_word());
    }
    selected_slave();
    put(RPINR20, SLAVE_SDI | SLAVE_SCK << 8);
    put(SPI1STAT, SPISTAT_SPIEN);
    assert_false(takes_a_word()); /* another slave hears the clock */
    selected_slave();
    dspic_power_off(bench.chip, dspic_now_fs(bench.chip));
    assert_false(takes_a_word());
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(a_whole_word_ends_with_its_last_edge),
        TEST(a_word_that_waited_follows_a_whole_one),
        TEST(edges_so_far_are_played_when_asked_for_and_the_others_follow),
        TEST(whatever_looks_at_a_word_or_breaks_it_finds_its_edges),
        TEST(other_registers_leave_a_word_whole),
        TEST(a_slave_takes_a_word_as_it_takes_its_edges),
        TEST(nothing_is_done_where_a_word_is_not_that_simple),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
