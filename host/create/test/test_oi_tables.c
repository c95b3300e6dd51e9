/* The tables of the Open Interface add up: groups are as long as their packets, names and numbers are those of the
 * manual. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <assert.h>
#include <cmocka.h>

#include "create_oi.h"

/* All packets in a row, as a group sends them. */
struct row {
#define MEMBER(id, name, bytes, is_signed, unit, versions) uint8_t packet_##id[bytes];
    CREATE_OI_PACKETS(MEMBER)
#undef MEMBER
};

#define SUM(id, first, last, bytes, versions)                                                                          \
    static_assert(offsetof(struct row, packet_##last) + sizeof((struct row *)0)->packet_##last -                       \
                          offsetof(struct row, packet_##first) ==                                                      \
                      bytes,                                                                                           \
                  "group " #id " is as long as its packets");
CREATE_OI_GROUPS(SUM)
#undef SUM

static const uint8_t ids[] = {
#define ID(id, name, bytes, is_signed, unit, versions) id,
    CREATE_OI_PACKETS(ID)
#undef ID
};

static void packets_follow_one_another(void **state)
{
    (void)state;
    assert_int_equal(sizeof ids, CREATE_OI_PACKET_MAX - CREATE_OI_PACKET_MIN + 1);
    for (size_t i = 0; i < sizeof ids; i++) {
        assert_int_equal(ids[i], CREATE_OI_PACKET_MIN + i);
    }
}

static void only_values_that_can_be_negative_are_signed(void **state)
{
    (void)state;
    static const uint8_t is_signed[] = {19, 20, 23, 24, 39, 40, 41, 42, 43, 44, 54, 55, 56, 57};
    static const uint8_t table[CREATE_OI_PACKET_MAX + 1] = {
#define SIGN(id, name, bytes, sign, unit, versions) [id] = sign,
        CREATE_OI_PACKETS(SIGN)
#undef SIGN
    };
    size_t found = 0;
    for (size_t id = 0; id <= CREATE_OI_PACKET_MAX; id++) {
        if (table[id]) {
            assert_int_equal(id, is_signed[found++]);
        }
    }
    assert_int_equal(found, sizeof is_signed);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(packets_follow_one_another),
        cmocka_unit_test(only_values_that_can_be_negative_are_signed),
    };
    return cmocka_run_group_tests_name("create_oi", tests, NULL, NULL);
}
