/* DMA: each documented side effect, one test of its own. */
#include "bench.h"

static void dma_feeds_and_empties_a_slave_and_stops_after_its_block(void **state)
{
    (void)state;
    slave();
    uint16_t *ram = dspic_dma_ram(bench.chip);
    ram[0] = 0x2222;
    ram[1] = 0x3333;
    channel(0, DMACON_FROM_RAM | DMACON_MODE_ONE_SHOT, IRQ_SPI2, SPI2BUF, 2);
    channel(1, DMACON_MODE_ONE_SHOT, IRQ_SPI2, SPI2BUF, 3);
    put(SPI2BUF, 0x1111);
    slave_select(true);
    assert_int_equal(clock_slave(0xA001, 16), 0x1111);
    assert_int_equal(clock_slave(0xA002, 16), 0x2222);
    assert_false(flagged(IRQ_DMA1));
    assert_int_equal(clock_slave(0xA003, 16), 0x3333);
    assert_true(flagged(IRQ_DMA1));
    assert_memory_equal(ram + 32, ((uint16_t[]){0xA001, 0xA002, 0xA003}), 6);
    assert_false(get(DMA0CON + DMA_STRIDE) & DMACON_CHEN);
    clock_slave(0xA004, 16);
    clock_slave(0xA005, 16); /* nobody reads any more */
    assert_true(get(SPI2STAT) & SPISTAT_SPIROV);
    assert_int_equal(ram[35], 0);
}

static void ping_pong_alternates_its_blocks(void **state)
{
    (void)state;
    slave();
    channel(1, DMACON_MODE_PING_PONG, IRQ_SPI2, SPI2BUF, 2);
    slave_select(true);
    for (uint16_t i = 1; i <= 5; i++)
        clock_slave(i, 16);
    const uint16_t *ram = dspic_dma_ram(bench.chip);
    assert_memory_equal(ram + 32, ((uint16_t[]){5, 2}), 4);
    assert_memory_equal(ram + 40, ((uint16_t[]){3, 4}), 4);
}

static void force_moves_one_item(void **state)
{
    (void)state;
    master();
    dspic_dma_ram(bench.chip)[0] = 0x77;
    channel(0, DMACON_FROM_RAM, IRQ_SPI1, SPI1BUF, 4);
    pass(200u * US);
    assert_int_equal(bench.rises, 0); /* the first transfer of a master waits to be asked for */
    put(DMA0REQ, IRQ_SPI1 | DMAREQ_FORCE);
    pass(100u * US);
    assert_true(bench.rises > 0);
    assert_false(get(DMA0REQ) & DMAREQ_FORCE);
}

static void the_end_of_a_block_flips_the_ping_pong_flag(void **state)
{
    (void)state;
    slave();
    enable(IRQ_DMA1, 4);
    channel(1, DMACON_MODE_PING_PONG, IRQ_SPI2, SPI2BUF, 2);
    slave_select(true);
    for (unsigned block = 1; block <= 4u; block++) {
        clock_slave(0, 16);
        assert_int_equal(get(DMACS1) & 2u, block % 2u ? 0u : 2u); /* not before the block is whole */
        clock_slave(0, 16);
        assert_int_equal(get(DMACS1) & 2u, block % 2u ? 2u : 0u);
        assert_int_equal(get(DMACS1) >> 8 & 15u, 1); /* the channel that was active last */
        pass(10u * US);
        assert_int_equal(bench.served[IRQ_DMA1], block);
    }
}

static void one_shot_ping_pong_stops_after_both_blocks(void **state)
{
    (void)state;
    slave();
    channel(1, DMACON_MODE_PING_PONG | DMACON_MODE_ONE_SHOT, IRQ_SPI2, SPI2BUF, 1);
    slave_select(true);
    clock_slave(0x11, 16);
    assert_true(get(DMA0CON + DMA_STRIDE) & DMACON_CHEN);
    clock_slave(0x22, 16);
    assert_false(get(DMA0CON + DMA_STRIDE) & DMACON_CHEN);
    clock_slave(0x33, 16);
    const uint16_t *ram = dspic_dma_ram(bench.chip);
    assert_int_equal(ram[32], 0x11);
    assert_int_equal(ram[40], 0x22);
}

enum { LATENCY = 40 }; /* cycles: long enough to do something meanwhile */

static void power_with_latency(void)
{
    struct dspic_parameters parameters = standard();
    parameters.dma_cycles = LATENCY;
    power(&parameters);
    slave();
    channel(1, DMACON_MODE_ONE_SHOT, IRQ_SPI2, SPI2BUF, 1);
    slave_select(true);
    clock_slave(0xC0DE, 16);
}

static void a_request_is_served_after_its_latency(void **state)
{
    (void)state;
    power_with_latency();
    const uint16_t *ram = dspic_dma_ram(bench.chip);
    pass((LATENCY - 1u) * cycle_fs());
    assert_int_equal(ram[32], 0);
    pass(2u * cycle_fs());
    assert_int_equal(ram[32], 0xC0DE);
    assert_false(get(SPI2STAT) & SPISTAT_SPIRBF); /* the channel has read the buffer */
}

static void a_channel_switched_off_loses_the_request_under_way(void **state)
{
    (void)state;
    power_with_latency();
    clear(DMA0CON + DMA_STRIDE, DMACON_CHEN);
    pass(2u * LATENCY * cycle_fs());
    assert_int_equal(dspic_dma_ram(bench.chip)[32], 0);
    assert_true(get(SPI2STAT) & SPISTAT_SPIRBF);
}

static void a_request_of_before_is_not_the_new_blocks(void **state)
{
    (void)state;
    power_with_latency();
    clear(DMA0CON + DMA_STRIDE, DMACON_CHEN);
    set(DMA0CON + DMA_STRIDE, DMACON_CHEN);
    pass(2u * LATENCY * cycle_fs());
    assert_int_equal(dspic_dma_ram(bench.chip)[32], 0);
    assert_true(get(DMA0CON + DMA_STRIDE) & DMACON_CHEN);
}

static void requests_mind_neither_flag_nor_enable_of_their_interrupt(void **state)
{
    (void)state;
    slave();
    channel(1, 0, IRQ_SPI2, SPI2BUF, 4);
    slave_select(true);
    flag(IRQ_SPI2); /* and nobody clears it: disabled */
    clock_slave(0x1001, 16);
    clock_slave(0x1002, 16);
    assert_memory_equal(dspic_dma_ram(bench.chip) + 32, ((uint16_t[]){0x1001, 0x1002}), 4);
    assert_true(flagged(IRQ_SPI2));
}

static void a_disabled_channel_ignores_force(void **state)
{
    (void)state;
    master();
    channel(0, DMACON_FROM_RAM, IRQ_SPI1, SPI1BUF, 4);
    clear(DMA0CON, DMACON_CHEN);
    put(DMA0REQ, IRQ_SPI1 | DMAREQ_FORCE);
    pass(400u * US);
    assert_int_equal(bench.rises, 0);
}

static void a_timer_may_pace_a_master(void **state)
{
    (void)state;
    master();
    uint16_t *ram = dspic_dma_ram(bench.chip);
    ram[0] = 0x81;
    ram[1] = 0x42;
    channel(0, DMACON_FROM_RAM | DMACON_MODE_ONE_SHOT, IRQ_T2, SPI1BUF, 2);
    put(PR2, 999); /* 271 us */
    put(T2CON, TCON_TON);
    pass(250u * US);
    assert_int_equal(bench.rises, 0);
    pass(250u * US);
    assert_int_equal(bench.rises, 8);
    pass(600u * US);
    assert_int_equal(bench.rises, 16);
    assert_int_equal(bench.sent & 0xFFFFu, 0x8142);
}

static void a_new_block_begins_at_its_first_word(void **state)
{
    (void)state;
    slave();
    channel(1, DMACON_MODE_ONE_SHOT, IRQ_SPI2, SPI2BUF, 4);
    slave_select(true);
    clock_slave(1, 16);
    clock_slave(2, 16);
    clear(DMA0CON + DMA_STRIDE, DMACON_CHEN);
    set(DMA0CON + DMA_STRIDE, DMACON_CHEN);
    clock_slave(3, 16);
    assert_memory_equal(dspic_dma_ram(bench.chip) + 32, ((uint16_t[]){3, 2, 0}), 6);
}

static void a_collision_is_marked_and_traps(void **state)
{
    (void)state;
    dspic_disturb_collision(bench.chip, 1, false);
    assert_int_equal(get(DMACS0), 1u << 1);
    dspic_disturb_collision(bench.chip, 2, true);
    assert_int_equal(get(DMACS0), 1u << 1 | 1u << (2 + DMACS0_PERIPHERAL_SHIFT));
    assert_int_equal(bench.traps, 2);
    assert_true(get(INTCON1) & INTCON1_DMACERR);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(dma_feeds_and_empties_a_slave_and_stops_after_its_block),
        TEST(ping_pong_alternates_its_blocks),
        TEST(force_moves_one_item),
        TEST(the_end_of_a_block_flips_the_ping_pong_flag),
        TEST(one_shot_ping_pong_stops_after_both_blocks),
        TEST(a_request_is_served_after_its_latency),
        TEST(a_channel_switched_off_loses_the_request_under_way),
        TEST(a_request_of_before_is_not_the_new_blocks),
        TEST(requests_mind_neither_flag_nor_enable_of_their_interrupt),
        TEST(a_disabled_channel_ignores_force),
        TEST(a_timer_may_pace_a_master),
        TEST(a_new_block_begins_at_its_first_word),
        TEST(a_collision_is_marked_and_traps),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
