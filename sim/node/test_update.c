/* Identity, health and firmware updates of one node through its link, with the supply cut anywhere. */
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "crc32.h"
#include "service.h"
#include "sim_node_lab.h"

enum {
    ROWS = 18, /* of the image: pages begin at rows 7 and 15 of it */
    BODY = ROWS * WHISKER_LIMIT_FLASH_ROW_BYTES,
    BLOCKS = BODY / SERVICE_BLOCK_BYTES,
    NEW_VERSION = 0x0203,
    PATIENCE = 4 * WHISKER_LIMIT_BUSY_TICKS_MAX,
};

struct image {
    uint8_t bytes[WHISKER_IMAGE_HEADER_BYTES + BODY];
};

struct bench {
    sim_node *node;
    uint8_t tick;
    uint64_t ticks;
    bool answered;                        /* the latest window brought an answer to the order before */
    uint8_t record[WHISKER_RECORD_BYTES]; /* of the latest first window */
    uint8_t answer[WHISKER_RECORD_BYTES];
    uint8_t asked; /* tick of the service order before */
};

static void seal(struct image *image)
{
    whisker_put_u32(image->bytes + WHISKER_IMAGE_HEADER_HEADER_CRC32,
                    crc32_of(WHISKER_CRC32_INIT, image->bytes, WHISKER_IMAGE_HEADER_HEADER_CRC32) ^
                        WHISKER_CRC32_XOR_OUT);
}

static struct image image_of(uint16_t version)
{
    struct image image;
    uint8_t *header = image.bytes;
    memset(&image, 0, sizeof image);
    for (uint32_t i = 0; i < BODY; i++)
        image.bytes[WHISKER_IMAGE_HEADER_BYTES + i] = (uint8_t)(i * 31u ^ i >> 7 ^ version);
    whisker_put_u32(header + WHISKER_IMAGE_HEADER_MAGIC, WHISKER_LIMIT_IMAGE_MAGIC);
    whisker_put_u16(header + WHISKER_IMAGE_HEADER_CHIP, WHISKER_LIMIT_CHIP_ID);
    header[WHISKER_IMAGE_HEADER_WIRE_VERSION] = WHISKER_WIRE_VERSION;
    header[WHISKER_IMAGE_HEADER_FORMAT] = WHISKER_LIMIT_IMAGE_FORMAT;
    whisker_put_u32(header + WHISKER_IMAGE_HEADER_LENGTH, BODY);
    whisker_put_u32(header + WHISKER_IMAGE_HEADER_BODY_CRC32,
                    crc32_of(WHISKER_CRC32_INIT, header + WHISKER_IMAGE_HEADER_BYTES, BODY) ^ WHISKER_CRC32_XOR_OUT);
    whisker_put_u16(header + WHISKER_IMAGE_HEADER_VERSION, version);
    whisker_put_u16(header + WHISKER_IMAGE_HEADER_FIRST_ROW, WHISKER_LIMIT_APPLICATION_ROW + 1u);
    seal(&image);
    return image;
}

/* ---------------------------------------------------------------------------------------------------------- the bus */

static void window(struct bench *b, const uint8_t *out, unsigned bytes, uint8_t in[WHISKER_RECORD_BYTES])
{
    sim_node_select(b->node, true);
    memset(in, 0, WHISKER_RECORD_BYTES);
    for (unsigned bit = 0; bit < 8u * bytes; bit++) {
        const bool mosi = ((unsigned)out[bit / 8u] >> (7u - bit % 8u) & 1u) != 0,
                   miso = sim_node_sck(b->node, true, mosi);
        sim_node_sck(b->node, false, mosi);
        if (bit < 8u * WHISKER_RECORD_BYTES)
            in[bit / 8u] |= (uint8_t)(miso << (7u - bit % 8u));
    }
    sim_node_select(b->node, false);
}

/* A tick, with a service order if `command` is not negative. */
static void tick(struct bench *b, int command, const uint8_t *argument, const uint8_t *data)
{
    uint8_t bytes[WHISKER_SERVICE_BYTES] = {++b->tick};
    bytes[WHISKER_ORDER_COMMAND] = command < 0 ? WHISKER_COMMAND_SAMPLE : WHISKER_COMMAND_SERVICE;
    bytes[WHISKER_ORDER_CRC] = whisker_crc8(bytes, WHISKER_ORDER_CRC);
    b->ticks++;
    sim_node_sync(b->node, (struct sim_field){0});
    window(b, bytes, WHISKER_ORDER_BYTES, b->record);
    b->answered = false;
    if (command >= 0) {
        bytes[WHISKER_SERVICE_COMMAND] = (uint8_t)command;
        memcpy(bytes + WHISKER_SERVICE_ARGUMENT, argument, 5);
        bytes[WHISKER_SERVICE_HEAD_CRC] = whisker_crc8(bytes, WHISKER_SERVICE_HEAD_CRC);
        memcpy(bytes + WHISKER_SERVICE_DATA, data, SERVICE_BLOCK_BYTES);
        const uint32_t crc = crc32_of(WHISKER_CRC32_INIT, bytes, WHISKER_SERVICE_CRC32) ^ WHISKER_CRC32_XOR_OUT;
        for (unsigned i = 0; i < 4u; i++)
            bytes[WHISKER_SERVICE_CRC32 + i] = (uint8_t)(crc >> (24u - 8u * i) & 0xFFu);
        window(b, bytes, WHISKER_SERVICE_BYTES, b->answer);
        b->answered = whisker_crc8(b->answer, WHISKER_RECORD_CRC) == b->answer[WHISKER_RECORD_CRC] &&
                      b->answer[WHISKER_RECORD_TICK] == b->asked &&
                      b->answer[WHISKER_RECORD_STATUS + 1u] >> 2 == WHISKER_CODE_ANSWER;
        b->asked = b->tick;
    }
    sim_node_run(b->node);
}

static const uint8_t NOTHING[SERVICE_BLOCK_BYTES];

/* Asks, again and again if need be, until there is an answer; false if none comes. */
static bool ask(struct bench *b, uint8_t command, const uint8_t *argument, const uint8_t *data, uint16_t *alpha,
                uint16_t *beta)
{
    for (int i = 0; i < PATIENCE; i++) {
        if (i % 4 == 0)
            tick(b, command, argument, data);
        tick(b, WHISKER_SERVICE_COMMAND_POLL, NOTHING, NOTHING);
        if (b->answered && (b->answer[WHISKER_RECORD_STATUS] == command)) {
            *alpha = whisker_get_u16(b->answer + WHISKER_RECORD_ALPHA);
            *beta = whisker_get_u16(b->answer + WHISKER_RECORD_BETA);
            return true;
        }
        if (sim_node_dark(b->node))
            return false;
    }
    return false;
}

static uint32_t info(struct bench *b, uint8_t item)
{
    const uint8_t argument[5] = {item};
    uint16_t alpha = 0, beta = 0;
    assert_true(ask(b, WHISKER_SERVICE_COMMAND_INFO, argument, NOTHING, &alpha, &beta));
    return alpha | (uint32_t)beta << 16;
}

static uint16_t state_of(struct bench *b)
{
    return (uint16_t)(info(b, WHISKER_INFO_CHIP) >> 16);
}

/* ------------------------------------------------------------------------------------------------------- an update */

/* Returns the state at its end, or -1 if the node fell silent for good. */
static int update(struct bench *b, const struct image *image, uint32_t serial)
{
    uint8_t argument[5] = {0};
    uint16_t next = 0, state = 0;
    whisker_put_u32(argument, serial);
    tick(b, WHISKER_SERVICE_COMMAND_ENTER, argument, NOTHING);
    for (int i = 0; i < PATIENCE && state != WHISKER_NODE_STATE_LOADING; i++) {
        if (!ask(b, WHISKER_SERVICE_COMMAND_BEGIN, argument, image->bytes, &next, &state))
            return -1;
        if (state > WHISKER_NODE_STATE_COMPLETE)
            return state;
        if (state == WHISKER_NODE_STATE_APPLICATION)
            tick(b, WHISKER_SERVICE_COMMAND_ENTER, argument, NOTHING);
    }
    while (next < BLOCKS && state == WHISKER_NODE_STATE_LOADING) {
        uint8_t number[5] = {(uint8_t)(next & 0xFFu), (uint8_t)(next >> 8)};
        const uint8_t *block = image->bytes + WHISKER_IMAGE_HEADER_BYTES + next * SERVICE_BLOCK_BYTES;
        if (!ask(b, WHISKER_SERVICE_COMMAND_BLOCK, number, block, &next, &state))
            return -1;
    }
    if (!ask(b, WHISKER_SERVICE_COMMAND_FINISH, NOTHING, NOTHING, &next, &state))
        return -1;
    tick(b, WHISKER_SERVICE_COMMAND_RUN, argument, NOTHING);
    return state;
}

static void begin(struct bench *b, uint64_t seed, uint32_t serial, uint16_t chip)
{
    struct sim_node_parameters parameters;
    sim_node_parameters_default(&parameters, seed);
    parameters.chip.serial = serial;
    parameters.chip.device_id = chip;
    *b = (struct bench){.node = sim_node_new_as(&parameters)};
    assert_non_null(b->node);
    sim_node_power_on(b->node);
}

static void ticks(struct bench *b, unsigned count)
{
    for (unsigned i = 0; i < count; i++)
        tick(b, -1, NULL, NULL);
}

static uint8_t code(const struct bench *b)
{
    return b->record[WHISKER_RECORD_STATUS + 1u] >> 2;
}

/* After a restart the sensor's start-up passes; then every record is good, or the loader says that it runs. */
static void settle(struct bench *b)
{
    ticks(b, 50);
    const uint8_t wanted = sim_node_version(b->node) == 0 ? WHISKER_CODE_LOADER : WHISKER_CODE_OK;
    for (int i = 0; i < 5; i++) {
        ticks(b, 1);
        assert_int_equal(whisker_crc8(b->record, WHISKER_RECORD_CRC), b->record[WHISKER_RECORD_CRC]);
        assert_int_equal(code(b), wanted);
    }
}

static void a_running_node_tells_who_it_is_and_loses_no_sample(void **state)
{
    (void)state;
    struct bench b;
    begin(&b, 3, 0x12345678, WHISKER_LIMIT_CHIP_ID);
    ticks(&b, 3);
    const uint8_t item[5] = {WHISKER_INFO_SERIAL};
    for (int i = 0; i < 200; i++) { /* an order in every tick */
        tick(&b, i % 2 ? (int)WHISKER_SERVICE_COMMAND_POLL : (int)WHISKER_SERVICE_COMMAND_INFO, item, NOTHING);
        assert_int_equal(whisker_get_u16(b.record + WHISKER_RECORD_STATUS), 0);
        assert_int_equal(b.record[WHISKER_RECORD_TICK], (uint8_t)(b.tick - 1u));
        assert_int_equal(b.answered, i > 0);
    }
    assert_int_equal(info(&b, WHISKER_INFO_SERIAL), 0x12345678);
    assert_int_equal(info(&b, WHISKER_INFO_CHIP), WHISKER_LIMIT_CHIP_ID);
    assert_int_equal(info(&b, WHISKER_INFO_FIRMWARE), SIM_NODE_VERSION);
    assert_int_equal(info(&b, WHISKER_INFO_WIRE) & 0xFFFFu, WHISKER_WIRE_VERSION);
    assert_int_equal(info(&b, 99), WHISKER_NODE_STATE_APPLICATION << 16);
    assert_int_equal(sim_node_violations(b.node), 0);
    sim_node_free(b.node);
}

static void faults_are_counted_once(void **state)
{
    (void)state;
    struct bench b;
    begin(&b, 4, 1, WHISKER_LIMIT_CHIP_ID);
    ticks(&b, 3);
    sim_node_fault(b.node, SIM_SENSOR_DEAD, 0);
    ticks(&b, 5);
    sim_node_fault(b.node, SIM_SENSOR_ERROR_BITS, 0x0008);
    ticks(&b, 60); /* the sensor resets itself after it has told an error */
    assert_int_equal(info(&b, WHISKER_INFO_HEALTH + WHISKER_HEALTH_SENSOR_ERROR) & 0xFFFFu, 1);
    assert_int_equal(info(&b, WHISKER_INFO_HEALTH + WHISKER_HEALTH_ORDER_CRC) & 0xFFFFu, 0);
    const uint32_t absent = info(&b, WHISKER_INFO_HEALTH + WHISKER_HEALTH_SENSOR_ABSENT);
    assert_true((absent & 0xFFFFu) >= 1);
    assert_int_equal(absent >> 16, WHISKER_HEALTH_SENSOR_ABSENT);
    sim_node_free(b.node);
}

static void an_update_runs_the_new_image(void **state)
{
    (void)state;
    struct bench b;
    const struct image image = image_of(NEW_VERSION);
    begin(&b, 5, 77, WHISKER_LIMIT_CHIP_ID);
    assert_int_equal(update(&b, &image, 0), WHISKER_NODE_STATE_COMPLETE);
    settle(&b);
    assert_int_equal(sim_node_version(b.node), NEW_VERSION);
    assert_int_equal(info(&b, WHISKER_INFO_FIRMWARE), NEW_VERSION);
    assert_int_equal(sim_node_violations(b.node), 0);
    print_message("%d bytes in %u ticks\n", BODY, (unsigned)b.ticks);
    sim_node_free(b.node);
}

static void unfit_images_are_refused_and_the_old_one_stays(void **state)
{
    (void)state;
    struct bench b;
    begin(&b, 6, 77, WHISKER_LIMIT_CHIP_ID);
    static const struct {
        unsigned at;
        uint8_t value;
        int refusal;
    } changes[] = {
        {WHISKER_IMAGE_HEADER_CHIP, 0x2A, WHISKER_NODE_STATE_OTHER_CHIP},
        {WHISKER_IMAGE_HEADER_WIRE_VERSION, WHISKER_WIRE_VERSION - 1, WHISKER_NODE_STATE_OLD_WIRE},
        {WHISKER_IMAGE_HEADER_FORMAT, 2, WHISKER_NODE_STATE_BAD_HEADER},
        {WHISKER_IMAGE_HEADER_LENGTH, 1, WHISKER_NODE_STATE_BAD_HEADER},
        {WHISKER_IMAGE_HEADER_LENGTH + 2, 0xFF, WHISKER_NODE_STATE_BAD_HEADER},
        {WHISKER_IMAGE_HEADER_FIRST_ROW, 0, WHISKER_NODE_STATE_BAD_HEADER},
        {WHISKER_IMAGE_HEADER_MAGIC, 0, WHISKER_NODE_STATE_BAD_HEADER},
    };
    for (size_t i = 0; i < sizeof changes / sizeof changes[0]; i++) {
        struct image image = image_of(NEW_VERSION);
        image.bytes[changes[i].at] = changes[i].value;
        seal(&image);
        assert_int_equal(update(&b, &image, 0), changes[i].refusal);
        image.bytes[WHISKER_IMAGE_HEADER_HEADER_CRC32] ^= 1u;
        assert_int_equal(update(&b, &image, 0), WHISKER_NODE_STATE_BAD_HEADER);
    }
    const struct image image = image_of(NEW_VERSION);
    assert_int_equal(update(&b, &image, 78), WHISKER_NODE_STATE_NOT_ADDRESSED);
    tick(&b, WHISKER_SERVICE_COMMAND_RUN, NOTHING, NOTHING);
    settle(&b);
    assert_int_equal(sim_node_version(b.node), SIM_NODE_VERSION);
    assert_int_equal(update(&b, &image, 77), WHISKER_NODE_STATE_COMPLETE);
    sim_node_free(b.node);
}

static void a_body_other_than_announced_is_not_run(void **state)
{
    (void)state;
    struct bench b;
    struct image image = image_of(NEW_VERSION);
    begin(&b, 7, 77, WHISKER_LIMIT_CHIP_ID);
    image.bytes[WHISKER_IMAGE_HEADER_BYTES + 1000] ^= 4u;
    assert_int_equal(update(&b, &image, 0), WHISKER_NODE_STATE_BAD_IMAGE);
    settle(&b);
    assert_int_equal(sim_node_version(b.node), 0);
    sim_node_disturb(b.node, SIM_NODE_RESET, RCON_EXTR);
    settle(&b);
    assert_int_equal(sim_node_version(b.node), 0);
    assert_int_equal(state_of(&b), WHISKER_NODE_STATE_LOADER);
    sim_node_free(b.node);
}

static void another_chip_refuses_the_image(void **state)
{
    (void)state;
    struct bench b;
    const struct image image = image_of(NEW_VERSION);
    begin(&b, 8, 77, 0x062A);
    assert_int_equal(update(&b, &image, 0), WHISKER_NODE_STATE_OTHER_CHIP);
    sim_node_free(b.node);
}

/* --------------------------------------------------------------------------------------------------- cuts of power */

static uint64_t mix(uint64_t x)
{
    x = (x ^ x >> 30) * UINT64_C(0xBF58476D1CE4E5B9);
    x = (x ^ x >> 27) * UINT64_C(0x94D049BB133111EB);
    return x ^ x >> 31;
}

/* Cuts the supply so long after the update began; what then runs is one of the two, or the loader, and a new update
 * succeeds. */
static void cut_once(uint64_t after_ns, uint64_t seed, unsigned seen[3])
{
    struct bench b;
    const struct image image = image_of(NEW_VERSION);
    begin(&b, seed, 77, WHISKER_LIMIT_CHIP_ID);
    ticks(&b, 1);
    sim_node_cut(b.node, after_ns);
    update(&b, &image, 0);
    while (!sim_node_dark(b.node))
        ticks(&b, 1);
    ticks(&b, 3);
    sim_node_restore(b.node);
    settle(&b);
    const uint16_t version = sim_node_version(b.node);
    assert_true(version == 0 || version == SIM_NODE_VERSION || version == NEW_VERSION);
    seen[version == 0 ? 0 : version == SIM_NODE_VERSION ? 1 : 2]++;
    assert_int_equal(update(&b, &image, 0), WHISKER_NODE_STATE_COMPLETE);
    settle(&b);
    assert_int_equal(sim_node_version(b.node), NEW_VERSION);
    sim_node_free(b.node);
}

static void power_may_fail_at_any_time(void **state)
{
    (void)state;
    const char *asked = getenv("WHISKER_CUTS");
    const unsigned cuts = asked ? (unsigned)strtoul(asked, NULL, 10) : 150u;
    unsigned seen[3] = {0};
    struct bench b;
    const struct image image = image_of(NEW_VERSION);
    begin(&b, 1, 77, WHISKER_LIMIT_CHIP_ID);
    update(&b, &image, 0);
    const uint64_t length_ns = (b.ticks + 4u) * SIM_TICK_NS;
    sim_node_free(b.node);
    for (unsigned i = 0; i < cuts; i++)
        cut_once(mix(i + UINT64_C(0x9E3779B97F4A7C15)) % length_ns, i, seen);
    print_message("%u cuts: %u times the loader waits, %u the old image runs, %u the new one\n", cuts, seen[0], seen[1],
                  seen[2]);
    assert_true(seen[0] > 0 && seen[1] > 0 && seen[2] > 0);
}

/* The flash as a cut would leave it, at every word of each write and erase that a whole update makes: the last two are
 * the header's row. Found by time: cuts a word's time apart around the end. */
static void power_may_fail_while_the_header_is_written(void **state)
{
    (void)state;
    unsigned seen[3] = {0};
    struct bench b;
    const struct image image = image_of(NEW_VERSION);
    begin(&b, 1, 77, WHISKER_LIMIT_CHIP_ID);
    update(&b, &image, 0);
    const uint64_t end_ns = b.ticks * SIM_TICK_NS;
    sim_node_free(b.node);
    for (uint64_t before = 0; before < 128u; before++)
        cut_once(end_ns - before * 40000u, 1, seen);
    assert_true(seen[0] > 0 && seen[2] > 0);
    assert_int_equal(seen[1], 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_running_node_tells_who_it_is_and_loses_no_sample),
        cmocka_unit_test(faults_are_counted_once),
        cmocka_unit_test(an_update_runs_the_new_image),
        cmocka_unit_test(unfit_images_are_refused_and_the_old_one_stays),
        cmocka_unit_test(a_body_other_than_announced_is_not_run),
        cmocka_unit_test(another_chip_refuses_the_image),
        cmocka_unit_test(power_may_fail_while_the_header_is_written),
        cmocka_unit_test(power_may_fail_at_any_time),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
