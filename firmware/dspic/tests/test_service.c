/* Service orders against the golden windows of protocol/vectors/services.txt. */
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "orders.h"

static void take(struct service *service, const uint8_t bytes[WHISKER_SERVICE_BYTES])
{
    uint16_t words[SERVICE_WORDS];
    words_of(bytes, words);
    service_take(service, words);
}

static bool is_answer(const uint16_t words[LINK_WORDS], uint8_t tick, uint8_t command, uint16_t alpha, uint16_t beta)
{
    uint8_t bytes[WHISKER_RECORD_BYTES];
    for (unsigned i = 0; i < LINK_WORDS; i++) {
        bytes[2u * i] = (uint8_t)(words[i] >> 8);
        bytes[2u * i + 1u] = (uint8_t)(words[i] & 0xFFu);
    }
    return whisker_crc8(bytes, WHISKER_RECORD_CRC) == bytes[WHISKER_RECORD_CRC] && bytes[0] == tick &&
           whisker_get_u16(bytes + WHISKER_RECORD_ALPHA) == alpha &&
           whisker_get_u16(bytes + WHISKER_RECORD_BETA) == beta &&
           whisker_get_u16(bytes + WHISKER_RECORD_STATUS) ==
               (WHISKER_CODE_ANSWER << WHISKER_STATUS_CODE_SHIFT | command);
}

static void golden_windows_are_taken_or_not(void **state)
{
    (void)state;
    char line[256], name[64], hex[128], outcome[16];
    unsigned seen = 0;
    FILE *file = fopen(VECTORS, "r");
    assert_non_null(file);
    while (fgets(line, sizeof line, file)) {
        if (line[0] == '#' || line[0] == '\n')
            continue;
        assert_int_equal(sscanf(line, "%63s | %120s | %15s", name, hex, outcome), 3);
        uint8_t bytes[WHISKER_SERVICE_BYTES];
        for (unsigned i = 0; i < sizeof bytes; i++) {
            unsigned byte;
            assert_int_equal(sscanf(hex + 2u * i, "%2x", &byte), 1);
            bytes[i] = (uint8_t)byte;
        }
        struct service service;
        service_start(&service);
        take(&service, bytes);
        assert_true(service.waiting);
        const bool whole = service_next(&service) != NULL;
        assert_int_equal(whole, strcmp(outcome, "good") == 0);
        assert_int_equal(service.waiting, whole);
        seen++;
    }
    fclose(file);
    assert_int_equal(seen, 11);
}

static void a_node_is_busy_until_it_has_answered_and_a_poll_repeats_the_answer(void **state)
{
    (void)state;
    static const uint16_t BUSY[LINK_WORDS] = {0};
    uint8_t bytes[WHISKER_SERVICE_BYTES], other[WHISKER_SERVICE_BYTES];
    struct service service;
    service_start(&service);
    assert_memory_equal(service_words(&service), BUSY, sizeof BUSY);
    order_of(bytes, 9, WHISKER_SERVICE_COMMAND_INFO, 0, NULL);
    take(&service, bytes);
    assert_memory_equal(service_words(&service), BUSY, sizeof BUSY);
    order_of(other, 10, WHISKER_SERVICE_COMMAND_RUN, 0, NULL);
    take(&service, other); /* while the first one waits: ignored */
    assert_non_null(service_next(&service));
    service_answer(&service, 0x1234, 0xABCD);
    assert_true(is_answer(service_words(&service), 9, WHISKER_SERVICE_COMMAND_INFO, 0x1234, 0xABCD));
    order_of(bytes, 11, WHISKER_SERVICE_COMMAND_POLL, 0, NULL);
    take(&service, bytes);
    assert_non_null(service_next(&service));
    service_answer(&service, 0, 0);
    assert_true(is_answer(service_words(&service), 11, WHISKER_SERVICE_COMMAND_INFO, 0x1234, 0xABCD));
}

static void a_serial_number_addresses_one_or_all(void **state)
{
    (void)state;
    uint8_t order[WHISKER_SERVICE_BYTES] = {0};
    assert_true(service_addresses(order, 5));
    whisker_put_u32(order + WHISKER_SERVICE_ARGUMENT, UINT32_C(0x80000005));
    assert_true(service_addresses(order, UINT32_C(0x80000005)));
    assert_false(service_addresses(order, 5));
}

static void crc32_has_its_published_check_value(void **state)
{
    (void)state;
    assert_int_equal(crc32_of(WHISKER_CRC32_INIT, (const uint8_t *)"123456789", 9) ^ WHISKER_CRC32_XOR_OUT,
                     WHISKER_CRC32_CHECK);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(golden_windows_are_taken_or_not),
        cmocka_unit_test(a_node_is_busy_until_it_has_answered_and_a_poll_repeats_the_answer),
        cmocka_unit_test(a_serial_number_addresses_one_or_all),
        cmocka_unit_test(crc32_has_its_published_check_value),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
