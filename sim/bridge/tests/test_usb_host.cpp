// The USB host model against a device made of a script: every irregular answer must be noticed and counted.
#include "cmocka_cpp.h"

#include <deque>

#include "usb_host.h"

using namespace bridge_sim;

namespace
{

constexpr size_t LIMIT = 512;

// Answers the packets that want an answer (IN tokens and data) with the next packet of the script; an empty one is
// silence. Keeps what it heard.
class ScriptedDevice : public UtmiDevice
{
  public:
    std::deque<Bytes> script;
    std::vector<Bytes> heard;

    void cycle() override
    {
        listen();
        talk();
        cycles++;
    }

  private:
    void listen()
    {
        if (in.rx_valid) {
            incoming_.push_back(in.rx_data);
        }
        if (!in.rx_active && !incoming_.empty()) {
            const uint8_t pid = incoming_[0];
            heard.push_back(incoming_);
            incoming_.clear();
            if ((pid == PID_IN || pid == PID_DATA0 || pid == PID_DATA1) && !script.empty()) {
                outgoing_ = script.front();
                script.pop_front();
                at_ = 0;
            }
        }
    }

    void talk()
    {
        out.tx_valid = at_ < outgoing_.size();
        if (out.tx_valid) {
            out.tx_data = outgoing_[at_];
            at_ += in.tx_ready;
        }
    }

    Bytes incoming_;
    Bytes outgoing_;
    size_t at_ = 0;
};

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

void nak_and_stall_are_told_apart(void **)
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
        cmocka_unit_test(sound_data_is_taken_and_acknowledged),
        cmocka_unit_test(wrong_crc16_is_not_acknowledged_but_retried),
        cmocka_unit_test(three_wrong_crcs_are_an_error),
        cmocka_unit_test(repeated_toggle_is_acknowledged_and_dropped),
        cmocka_unit_test(unsound_pid_is_an_error),
        cmocka_unit_test(silence_times_out),
        cmocka_unit_test(babble_is_an_error),
        cmocka_unit_test(nak_and_stall_are_told_apart),
        cmocka_unit_test(out_toggles_only_when_acknowledged),
        cmocka_unit_test(lost_ack_makes_the_copy_expected),
        cmocka_unit_test(an_answer_to_a_damaged_token_is_a_violation),
        cmocka_unit_test(damaged_token_has_a_wrong_crc5),
    };
    return cmocka_run_group_tests(tests, nullptr, nullptr);
}
