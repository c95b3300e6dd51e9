// Speeds, suspend, resume, packets that are not for the device or not acknowledged by its host, and how soon it
// answers.
#include "cmocka_cpp.h"

#include "device_kind.h"
#include "noisy_host.h"
#include "usb_control.h"

using namespace bridge_sim;

namespace
{

constexpr uint8_t BULK = 1;
constexpr size_t FAST_PACKET = 512;
constexpr size_t SLOW_PACKET = 64;
constexpr uint64_t RESUME_CYCLES = 2000; // a real host drives 20 ms

std::unique_ptr<DeviceKind> device_kind;

struct Fixture {
    std::unique_ptr<StreamDevice> made = device_kind->make();
    StreamDevice &device = *made;
    UsbHost host{device};
    uint64_t read = 0; // bytes of the stream

    explicit Fixture(BusSpeed speed = BusSpeed::HIGH)
    {
        device.byte = [](uint64_t index) { return static_cast<uint8_t>(index ^ index >> 8); };
        configure(speed);
    }
    void configure(BusSpeed speed)
    {
        Bytes none;
        assert_true(host.reset(speed));
        assert_true(control_transfer(host, {0, 5, 3, 0, 0}, none) == Outcome::OK);
        assert_true(control_transfer(host, {0, 9, 1, 0, 0}, none) == Outcome::OK);
        read = 0;
    }
    Bytes request(const SetupRequest &request)
    {
        Bytes data;
        assert_true(control_transfer(host, request, data) == Outcome::OK);
        return data;
    }
    void expect_packet(size_t size)
    {
        Bytes data;
        host.idle(2 * FAST_PACKET); // a byte a cycle goes into the endpoint
        assert_true(host.in(BULK, FAST_PACKET, data) == Outcome::OK);
        assert_int_equal(data.size(), size);
        for (uint8_t byte : data) {
            assert_int_equal(byte, device.byte(read++));
        }
    }
    void regular() const
    {
        assert_int_equal(host.counters().unexplained, 0);
        assert_true(device.slowest_answer() <= device.answer_limit());
    }
};

size_t bulk_packet(const Bytes &configuration)
{
    for (size_t at = 0; at + 6 < configuration.size(); at += configuration[at]) {
        if (configuration[at + 1] == 5 && configuration[at + 3] == 2) {
            return configuration[at + 4] | static_cast<size_t>(configuration[at + 5]) << 8;
        }
    }
    return 0;
}

void at_full_speed_packets_are_short(void **)
{
    Fixture f(BusSpeed::FULL);
    assert_int_equal(bulk_packet(f.request({0x80, 6, 0x0200, 0, 255})), SLOW_PACKET);
    assert_int_equal(bulk_packet(f.request({0x80, 6, 0x0700, 0, 255})), FAST_PACKET);
    f.device.available = 20 * SLOW_PACKET;
    for (int i = 0; i < 20; i++) {
        f.expect_packet(SLOW_PACKET);
    }
    f.regular();
}

void speed_may_change_at_every_reset(void **)
{
    Fixture f(BusSpeed::HIGH);
    for (BusSpeed speed : {BusSpeed::FULL, BusSpeed::HIGH, BusSpeed::FULL, BusSpeed::HIGH}) {
        const size_t size = speed == BusSpeed::HIGH ? FAST_PACKET : SLOW_PACKET;
        f.configure(speed);
        f.device.available = f.device.taken() + 4 * FAST_PACKET;
        assert_int_equal(bulk_packet(f.request({0x80, 6, 0x0200, 0, 255})), size);
        f.expect_packet(size);
        f.expect_packet(size);
        f.expect_packet(size);
    }
    f.regular();
}

void after_suspend_everything_is_as_it_was(void **)
{
    for (BusSpeed speed : {BusSpeed::HIGH, BusSpeed::FULL}) {
        const size_t size = speed == BusSpeed::HIGH ? FAST_PACKET : SLOW_PACKET;
        Fixture f(speed);
        f.device.available = 20 * FAST_PACKET; // more than the device holds: the rest must not move while it sleeps
        f.expect_packet(size);
        const uint64_t restarts = f.device.restarts();
        for (int round = 0; round < 2; round++) {
            assert_true(f.host.bus().suspend());
            assert_true(f.device.suspended());
            f.host.idle(100000);
            assert_true(f.device.suspended());
            assert_true(f.host.bus().resume(RESUME_CYCLES));
            assert_false(f.device.suspended());
            for (int packet = 0; packet < 4; packet++) {
                f.expect_packet(size); // the same toggles, the next bytes
            }
            assert_true(f.request({0x80, 8, 0, 0, 1}) == Bytes({1}));
        }
        assert_int_equal(f.device.restarts(), restarts);
        f.regular();
    }
}

void a_reset_ends_suspend(void **)
{
    Fixture f;
    f.device.available = 3 * FAST_PACKET;
    f.expect_packet(FAST_PACKET);
    assert_true(f.host.bus().suspend());
    f.configure(BusSpeed::HIGH);
    assert_false(f.device.suspended());
    f.expect_packet(FAST_PACKET);
    f.regular();
}

// With start-of-frame tokens alone the bus is not idle.
void frames_keep_the_device_awake(void **)
{
    Fixture f;
    for (int i = 0; i < 40; i++) {
        f.host.idle(7500);
        f.host.start_of_frame();
        assert_false(f.device.suspended());
    }
}

// The device's packet gets lost; the host turns to another device and acknowledges that one's.
void another_devices_ack_is_not_taken(void **)
{
    for (Noise noise : {Noise::OTHERS_IN, Noise::LONE_ACK}) {
        Fixture f;
        NoisyHost noisy(f.host, 1);
        f.device.available = 4 * FAST_PACKET;
        f.expect_packet(FAST_PACKET);
        f.host.bus().send(token_packet(PID_IN, static_cast<uint16_t>(f.host.address() | BULK << 7)));
        Bytes lost;
        assert_true(f.host.bus().receive(FAST_PACKET + 3, lost));
        f.host.idle(PACKET_GAP);
        assert_true(noisy.make(noise));
        f.expect_packet(FAST_PACKET);
        f.expect_packet(FAST_PACKET);
        f.regular();
    }
}

void noise_is_not_answered_and_changes_nothing(void **)
{
    Fixture f;
    NoisyHost noisy(f.host, 7);
    f.device.available = 400 * FAST_PACKET;
    for (int round = 0; round < 10; round++) {
        for (int kind = 0; kind < static_cast<int>(Noise::KINDS); kind++) {
            if (!noisy.make(static_cast<Noise>(kind))) {
                fail_msg("noise %d was answered", kind);
            }
            f.expect_packet(FAST_PACKET);
            f.request({0x80, 0, 0, 0, 2});
        }
    }
    f.regular();
}

// Data, NAK, STALL, descriptors, a status stage: whatever it is, within the time a link has (checked by regular()).
void answers_of_every_kind_are_in_time(void **)
{
    Fixture f;
    f.device.available = 2 * FAST_PACKET;
    f.expect_packet(FAST_PACKET);
    f.expect_packet(FAST_PACKET);
    Bytes data;
    assert_true(f.host.in(BULK, FAST_PACKET, data) == Outcome::NAK);
    constexpr uint16_t SIZES[] = {1, 17, 63, 64, 65, 255};
    for (const uint16_t size : SIZES) {
        data.clear();
        assert_true(control_transfer(f.host, {0xC0, 0x20, 0, 7, size}, data) == Outcome::OK);
        assert_int_equal(data.size(), size < 178 ? size : 178);
    }
    assert_true(control_transfer(f.host, {0x80, 6, 0x6300, 0, 9}, data) == Outcome::STALL);
    f.request({0x02, 3, 0, 0x80 | BULK, 0});
    assert_true(f.host.in(BULK, FAST_PACKET, data) == Outcome::STALL);
    assert_true(f.device.slowest_answer() > 0);
    f.regular();
}

// A report is taken only whole and right; whatever else comes is refused, and the device goes on.
void reports_of_odd_sizes_are_refused(void **)
{
    Fixture f;
    f.device.available = 100 * FAST_PACKET;
    constexpr uint16_t SIZES[] = {1, 2, 15, 16, 17, 63, 64, 65, 127, 128, 129, 1000};
    for (const uint16_t size : SIZES) {
        Bytes data(size, 0x01);
        assert_true(control_transfer(f.host, {0x21, 9, 0x0301, 1, size}, data) == Outcome::STALL);
        assert_true(f.request({0x80, 8, 0, 0, 1}) == Bytes({1}));
        f.expect_packet(FAST_PACKET);
    }
    f.regular();
}

} // namespace

int main(int argc, char **argv)
{
    device_kind = std::make_unique<DeviceKind>(argc, argv);
    const CMUnitTest tests[] = {
        cmocka_unit_test(at_full_speed_packets_are_short),
        cmocka_unit_test(speed_may_change_at_every_reset),
        cmocka_unit_test(after_suspend_everything_is_as_it_was),
        cmocka_unit_test(a_reset_ends_suspend),
        cmocka_unit_test(frames_keep_the_device_awake),
        cmocka_unit_test(another_devices_ack_is_not_taken),
        cmocka_unit_test(noise_is_not_answered_and_changes_nothing),
        cmocka_unit_test(answers_of_every_kind_are_in_time),
        cmocka_unit_test(reports_of_odd_sizes_are_refused),
    };
    return cmocka_run_group_tests(tests, nullptr, nullptr);
}
