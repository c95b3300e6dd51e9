/* Records and orders against the golden vectors of protocol/vectors/records.txt. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <stdio.h>
#include <string.h>

#include "record.h"
#include "whisker_protocol.h"

struct vector {
    char name[64], outcome[16];
    uint8_t bytes[8];
    unsigned tick; /* expected by the bridge */
};

/* Next vector of the file; false at its end. */
static bool read_vector(FILE *file, struct vector *vector)
{
    char line[256], hex[17];
    while (fgets(line, sizeof line, file)) {
        if (line[0] == '#' || line[0] == '\n')
            continue;
        assert_int_equal(sscanf(line, "%63s | %16s | %u | %15s", vector->name, hex, &vector->tick, vector->outcome), 4);
        assert_int_equal(strlen(hex), 16);
        for (unsigned i = 0; i < 8; i++) {
            unsigned byte;
            assert_int_equal(sscanf(hex + 2 * i, "%2x", &byte), 1);
            vector->bytes[i] = (uint8_t)byte;
        }
        return true;
    }
    return false;
}

/* What the node's own packer makes of the fields found in `bytes`. */
static void repack(const uint8_t bytes[8], uint8_t packed[8])
{
    const struct sensor_reading reading = {whisker_get_u16(bytes + WHISKER_RECORD_ALPHA),
                                           whisker_get_u16(bytes + WHISKER_RECORD_BETA),
                                           whisker_get_u16(bytes + WHISKER_RECORD_STATUS)};
    uint16_t words[LINK_WORDS];
    record_pack(&reading, bytes[WHISKER_RECORD_TICK], words);
    for (unsigned i = 0; i < LINK_WORDS; i++) {
        packed[2 * i] = (uint8_t)(words[i] >> 8);
        packed[2 * i + 1] = (uint8_t)words[i];
    }
}

static const char *outcome_of(const struct vector *vector)
{
    static const uint8_t ones[8] = {0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF};
    uint8_t packed[8];
    repack(vector->bytes, packed);
    if (memcmp(vector->bytes, ones, 8) == 0)
        return "absent";
    if (memcmp(vector->bytes, packed, 8) != 0)
        return "link_crc";
    return vector->bytes[WHISKER_RECORD_TICK] == vector->tick ? "good" : "link_tick";
}

static void golden_records_are_what_the_packer_makes(void **state)
{
    (void)state;
    struct vector vector;
    unsigned count = 0;
    FILE *file = fopen(VECTORS, "r");
    assert_non_null(file);
    for (; read_vector(file, &vector); count++)
        if (strcmp(outcome_of(&vector), vector.outcome) != 0)
            fail_msg("%s: %s, expected %s", vector.name, outcome_of(&vector), vector.outcome);
    fclose(file);
    assert_true(count >= 20);
}

static void the_first_byte_is_the_high_half_of_the_first_word(void **state)
{
    (void)state;
    const struct sensor_reading reading = {0x1234, 0xABCD, 0x0C01};
    uint16_t words[LINK_WORDS];
    record_pack(&reading, 0x77, words);
    assert_int_equal(words[0], 0x7734);
    assert_int_equal(words[1], 0x12CD);
    assert_int_equal(words[2], 0xAB01);
    assert_int_equal(words[3] >> 8, 0x0C);
}

static void order_words(uint8_t tick, uint8_t command, uint16_t words[LINK_WORDS])
{
    const uint8_t bytes[7] = {tick, command, 0, 0, 0, 0, 0};
    words[0] = (uint16_t)(tick << 8 | command);
    words[1] = 0;
    words[2] = 0;
    words[3] = whisker_crc8(bytes, 7);
}

static void every_tick_is_read_from_its_order(void **state)
{
    (void)state;
    for (unsigned tick = 0; tick < 256; tick++) {
        uint16_t words[LINK_WORDS];
        struct order order = {0, 0};
        order_words((uint8_t)tick, WHISKER_COMMAND_SAMPLE, words);
        assert_true(record_parse_order(words, &order));
        assert_int_equal(order.tick, tick);
        assert_int_equal(order.command, WHISKER_COMMAND_SAMPLE);
    }
}

static void up_to_three_flipped_bits_never_pass_and_change_nothing(void **state)
{
    (void)state;
    for (unsigned a = 0; a < 64; a++) {
        for (unsigned b = a; b < 64; b++) {
            for (unsigned c = b; c < 64; c++) {
                uint16_t words[LINK_WORDS];
                struct order order = {0xA5, 0x5A};
                order_words(0x3C, WHISKER_COMMAND_SAMPLE, words);
                words[a / 16] ^= (uint16_t)(1u << a % 16);
                if (b != a)
                    words[b / 16] ^= (uint16_t)(1u << b % 16);
                if (c != b)
                    words[c / 16] ^= (uint16_t)(1u << c % 16);
                assert_false(record_parse_order(words, &order));
                assert_int_equal(order.tick, 0xA5);
                assert_int_equal(order.command, 0x5A);
            }
        }
    }
}

static uint8_t crc8_bit_by_bit(const uint8_t *bytes, unsigned n)
{
    unsigned crc = WHISKER_CRC8_INIT;
    for (unsigned bit = 0; bit < 8u * n; bit++) {
        const unsigned top = crc >> 7 ^ ((unsigned)bytes[bit / 8u] >> (7u - bit % 8u) & 1u);
        crc = (crc << 1 & 0xFFu) ^ (top ? WHISKER_CRC8_POLYNOMIAL : 0u);
    }
    return (uint8_t)(crc ^ WHISKER_CRC8_XOR_OUT);
}

static void the_crc_by_nibbles_is_the_crc_bit_by_bit(void **state)
{
    (void)state;
    for (unsigned n = 0; n < 256u; n++) {
        const uint8_t bytes[3] = {(uint8_t)n, (uint8_t)(n * 7u + 1u), (uint8_t)~n};
        assert_int_equal(whisker_crc8(bytes, 3), crc8_bit_by_bit(bytes, 3));
    }
}

static void a_dead_mosi_is_no_order(void **state)
{
    (void)state;
    const uint16_t low[LINK_WORDS] = {0, 0, 0, 0};
    const uint16_t high[LINK_WORDS] = {0xFFFF, 0xFFFF, 0xFFFF, 0xFFFF};
    struct order order;
    assert_false(record_parse_order(low, &order));
    assert_false(record_parse_order(high, &order));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(golden_records_are_what_the_packer_makes),
        cmocka_unit_test(the_first_byte_is_the_high_half_of_the_first_word),
        cmocka_unit_test(every_tick_is_read_from_its_order),
        cmocka_unit_test(up_to_three_flipped_bits_never_pass_and_change_nothing),
        cmocka_unit_test(the_crc_by_nibbles_is_the_crc_bit_by_bit),
        cmocka_unit_test(a_dead_mosi_is_no_order),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
