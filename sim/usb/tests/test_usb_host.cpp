// The USB host model against a device made of a script: every irregular answer must be noticed and counted.
#include "cmocka_cpp.h"

#include "scripted_device.h"
#include "usb_host.h"

using namespace bridge_sim;

namespace
{

constexpr size_t LIMIT = 512;

struct Fixture {
    ScriptedDevice device;
    UsbHost host{device};
    Bytes data;

    Outcome in()
    {
        return host.in(1, LIMIT, data);
    }
    size_t acks() const
    {
        size_t count = 0;
        for (const Bytes &packet : device.heard) {
            count += packet[0] == PID_ACK ? 1 : 0;
        }
        return count;
    }
};

Bytes payload(uint8_t first)
{
    return {first, 0x55, 0xAA, 0x00};
}

Bytes data_of(bool toggle, uint8_t first)
{
    return data_packet(toggle, payload(first).data(), payload(first).size());
}

Bytes damaged(Bytes packet, size_t at)
{
    packet[at] ^= 0x01u;
    return packet;
}

// Address 0, endpoint 0 as every analyser shows it; address 9, endpoint 2 divided out by hand (remainder 10010, sent
// inverted as 01101, first bit sent lowest).
void tokens_carry_their_crc5(void **)
{
    assert_true(token_packet(PID_IN, 0) == Bytes({0x69, 0x00, 0x10}));
    assert_true(token_packet(PID_IN, 9 | 2 << 7) == Bytes({0x69, 0x09, 0xB1}));
}

// The published examples of tokens: the CRC-5 as it goes out on the wire, first bit highest.
void crc5_of_the_published_examples(void **)
{
    const struct {
        uint16_t address, endpoint;
        uint8_t sent;
    } examples[] = {{0x15, 0xE, 0x17}, {0x3A, 0xA, 0x1C}, {0x70, 0x4, 0x0E}, {0x01, 0x0, 0x17}};
    for (const auto &example : examples) {
        const uint8_t crc = usb_crc5(static_cast<uint16_t>(example.address | example.endpoint << 7));
        uint8_t sent = 0;
        for (int bit = 0; bit < 5; bit++) {
            sent = static_cast<uint8_t>(sent | ((crc >> bit) & 1) << (4 - bit));
        }
        assert_int_equal(sent, example.sent);
    }
}

// And of data: two packets of four bytes.
void crc16_of_the_published_examples(void **)
{
    const struct {
        uint8_t data[4];
        uint16_t sent; // first bit highest
    } examples[] = {{{0x00, 0x01, 0x02, 0x03}, 0xF75E}, {{0x23, 0x45, 0x67, 0x89}, 0x7038}};
    for (const auto &example : examples) {
        const uint16_t crc = usb_crc16(example.data, sizeof example.data);
        uint16_t sent = 0;
        for (int bit = 0; bit < 16; bit++) {
            sent = static_cast<uint16_t>(sent | ((crc >> bit) & 1) << (15 - bit));
        }
        assert_int_equal(sent, example.sent);
    }
}

// What is left in the register after a good packet and its CRC, whatever the packet (USB 2.0, 8.3.5.1 and 8.3.5.2):
// 01100 and 1000000000001101.
void residuals_are_the_specifications(void **)
{
    const auto divide = [](const std::vector<bool> &bits, unsigned width, unsigned polynomial) {
        const unsigned top = 1u << (width - 1);
        unsigned remainder = (1u << width) - 1;
        for (const bool bit : bits) {
            const bool feedback = ((remainder & top) != 0) != bit;
            remainder = (remainder << 1) & ((1u << width) - 1);
            remainder ^= feedback ? polynomial : 0;
        }
        return remainder;
    };
    const auto bits_of = [](const Bytes &bytes) {
        std::vector<bool> bits;
        for (const uint8_t byte : bytes) {
            for (int bit = 0; bit < 8; bit++) {
                bits.push_back((byte >> bit & 1) != 0);
            }
        }
        return bits;
    };
    for (unsigned seed = 0; seed < 64; seed++) {
        const Bytes token = token_packet(PID_IN, static_cast<uint16_t>(seed * 37));
        assert_int_equal(divide(bits_of({token[1], token[2]}), 5, 0x05), 0x0C);
        const Bytes data = data_packet(false, payload(static_cast<uint8_t>(seed)).data(), seed % 5);
        assert_int_equal(divide(bits_of(Bytes(data.begin() + 1, data.end())), 16, 0x8005), 0x800D);
    }
}

// CRC-16/USB of "123456789" in the catalogue of parametrised CRC algorithms.
void crc16_of_the_check_text(void **)
{
    const uint8_t text[] = {'1', '2', '3', '4', '5', '6', '7', '8', '9'};
    assert_int_equal(usb_crc16(text, sizeof text), 0xB4C8);
}

void sound_data_is_taken_and_acknowledged(void **)
{
    Fixture f;
    f.device.script = {data_of(false, 1), data_of(true, 2)};
    assert_true(f.in() == Outcome::OK);
    assert_true(f.data == payload(1));
    assert_true(f.in() == Outcome::OK);
    assert_true(f.data == payload(2));
    assert_int_equal(f.acks(), 2);
    assert_int_equal(f.host.counters().unexplained, 0);
}

void wrong_crc16_is_not_acknowledged_but_retried(void **)
{
    Fixture f;
    f.device.script = {damaged(data_of(false, 1), 3), data_of(false, 1)};
    assert_true(f.in() == Outcome::OK);
    assert_true(f.data == payload(1));
    assert_int_equal(f.acks(), 1);
    assert_int_equal(f.host.counters().crc_errors, 1);
    assert_int_equal(f.host.counters().unexplained, 1);
}

void three_wrong_crcs_are_an_error(void **)
{
    Fixture f;
    f.device.script = {damaged(data_of(false, 1), 1), damaged(data_of(false, 1), 1), damaged(data_of(false, 1), 1)};
    assert_true(f.in() == Outcome::CRC);
    assert_int_equal(f.acks(), 0);
}

void repeated_toggle_is_acknowledged_and_dropped(void **)
{
    Fixture f;
    f.device.script = {data_of(false, 1), data_of(false, 1), data_of(true, 2)};
    assert_true(f.in() == Outcome::OK);
    assert_true(f.in() == Outcome::OK);
    assert_true(f.data == payload(2));
    assert_int_equal(f.host.counters().duplicates, 1);
    assert_int_equal(f.host.counters().unexplained, 1);
}

void unsound_pid_is_an_error(void **)
{
    Fixture f;
    f.device.script = {damaged(data_of(false, 1), 0), {PID_ACK}, {0x00}};
    assert_true(f.in() == Outcome::PID);
    assert_int_equal(f.host.counters().pid_errors, 3);
}

void silence_times_out(void **)
{
    Fixture f;
    assert_true(f.in() == Outcome::TIMEOUT);
    assert_int_equal(f.host.counters().timeouts, 3);
}

void babble_is_an_error(void **)
{
    Fixture f;
    const Bytes long_payload(LIMIT + 1);
    const Bytes babble = data_packet(false, long_payload.data(), long_payload.size());
    f.device.script = {babble, babble, babble};
    assert_true(f.in() == Outcome::BABBLE);
}

void nak_and_stall_are_reported_apart(void **)
{
    Fixture f;
    f.device.script = {{PID_NAK}, {PID_STALL}};
    assert_true(f.in() == Outcome::NAK);
    assert_true(f.in() == Outcome::STALL);
    assert_int_equal(f.host.counters().naks, 1);
    assert_int_equal(f.host.counters().stalls, 1);
}

void out_toggles_only_when_acknowledged(void **)
{
    Fixture f;
    const uint8_t byte = 7;
    f.device.script = {{PID_NAK}, {PID_ACK}, {PID_ACK}};
    assert_true(f.host.out(2, &byte, 1) == Outcome::NAK);
    assert_true(f.host.out(2, &byte, 1) == Outcome::OK);
    assert_true(f.host.out(2, &byte, 1) == Outcome::OK);
    assert_int_equal(f.device.heard[1][0], PID_DATA0);
    assert_int_equal(f.device.heard[3][0], PID_DATA0);
    assert_int_equal(f.device.heard[5][0], PID_DATA1);
}

void lost_ack_makes_the_copy_expected(void **)
{
    Fixture f;
    f.device.script = {data_of(false, 1), data_of(false, 1), data_of(true, 2)};
    f.host.arm(WireFault::LOST_ACK);
    assert_true(f.in() == Outcome::OK);
    assert_int_equal(f.acks(), 0);
    assert_true(f.in() == Outcome::OK);
    assert_true(f.data == payload(2));
    assert_int_equal(f.host.counters().duplicates, 1);
    assert_int_equal(f.host.counters().unexplained, 0);
}

void an_answer_to_a_damaged_token_is_a_violation(void **)
{
    Fixture f;
    f.device.script = {data_of(false, 1), data_of(false, 1)};
    f.host.arm(WireFault::BAD_TOKEN);
    assert_true(f.in() == Outcome::OK);
    assert_int_equal(f.host.counters().violations, 1);
    assert_int_equal(f.host.counters().unexplained, 1);
}

void damaged_token_has_a_wrong_crc5(void **)
{
    Fixture f;
    f.device.script = {{}, data_of(false, 1)};
    f.host.arm(WireFault::BAD_TOKEN);
    assert_true(f.in() == Outcome::OK);
    assert_int_equal(f.host.counters().unexplained, 0);
    assert_true(f.device.heard[0] != f.device.heard[1]);
    assert_true(f.device.heard[1] == token_packet(PID_IN, 1 << 7));
}

} // namespace

int main()
{
    const CMUnitTest tests[] = {
        cmocka_unit_test(tokens_carry_their_crc5),
        cmocka_unit_test(crc16_of_the_check_text),
        cmocka_unit_test(crc5_of_the_published_examples),
        cmocka_unit_test(crc16_of_the_published_examples),
        cmocka_unit_test(residuals_are_the_specifications),
        cmocka_unit_test(sound_data_is_taken_and_acknowledged),
        cmocka_unit_test(wrong_crc16_is_not_acknowledged_but_retried),
        cmocka_unit_test(three_wrong_crcs_are_an_error),
        cmocka_unit_test(repeated_toggle_is_acknowledged_and_dropped),
        cmocka_unit_test(unsound_pid_is_an_error),
        cmocka_unit_test(silence_times_out),
        cmocka_unit_test(babble_is_an_error),
        cmocka_unit_test(nak_and_stall_are_reported_apart),
        cmocka_unit_test(out_toggles_only_when_acknowledged),
        cmocka_unit_test(lost_ack_makes_the_copy_expected),
        cmocka_unit_test(an_answer_to_a_damaged_token_is_a_violation),
        cmocka_unit_test(damaged_token_has_a_wrong_crc5),
    };
    return cmocka_run_group_tests(tests, nullptr, nullptr);
}
