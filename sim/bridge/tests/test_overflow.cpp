// A host that takes no frames: the bridge ticks on, its FIFO overflows, and the rig knows how much of it waits.
#include "cmocka_cpp.h"

#include <cerrno>

#include "make_rig.h"
#include "tick_runner.h"

using namespace bridge_sim;

namespace
{

constexpr size_t POPULATED = 2;
constexpr uint64_t TICKS = 200; // twice of what FIFO and endpoint hold, and more
constexpr size_t ENOUGH_BYTES = 4 * WHISKER_LIMIT_FIFO_BYTES;
constexpr uint8_t HID_SET_REPORT_TYPE = 0x21, HID_SET_REPORT = 0x09;
constexpr uint16_t HID_FEATURE = 0x0300;

class Host
{
  public:
    explicit Host(Level level)
        : rig_(make_rig(level, POPULATED, 1)), scheduler_(*rig_), log_("", ""),
          runner_(*rig_, scheduler_, std::nullopt, log_)
    {
        Descriptors descriptors;
        const char *error = nullptr;
        assert_true(rig_->power_on(descriptors, error));
    }

    void control(uint8_t run)
    {
        Urb urb;
        urb.setup = {HID_SET_REPORT_TYPE, HID_SET_REPORT, HID_FEATURE | WHISKER_REPORT_ID_CONTROL,
                     WHISKER_LIMIT_USB_HID_INTERFACE, WHISKER_REPORT_CONTROL_BYTES};
        urb.data.resize(WHISKER_REPORT_CONTROL_BYTES);
        urb.data[WHISKER_REPORT_CONTROL_ID] = WHISKER_REPORT_ID_CONTROL;
        urb.data[WHISKER_REPORT_CONTROL_WIRE_VERSION] = WHISKER_WIRE_VERSION;
        urb.data[WHISKER_REPORT_CONTROL_RUN] = run;
        urb.data[WHISKER_REPORT_CONTROL_SCK_DIVIDER] = WHISKER_LIMIT_SCK_DIVIDER_MIN;
        urb.data[WHISKER_REPORT_CONTROL_WORD_GAP] = WHISKER_LIMIT_WORD_GAP_MIN;
        urb.data[WHISKER_REPORT_CONTROL_SAMPLE_POINT] = WHISKER_LIMIT_SCK_DIVIDER_MIN - 1;
        whisker_put_u32(&urb.data[WHISKER_REPORT_CONTROL_LANE_MASK], (1u << LANES) - 1);
        whisker_put_u32(&urb.data[WHISKER_REPORT_CONTROL_TICK_PERIOD], WHISKER_LIMIT_TICK_PERIOD);
        scheduler_.submit(std::move(urb));
        assert_true(scheduler_.step());
        assert_int_equal(scheduler_.take_completed().at(0).status, 0);
    }

    // A request without data; what became of it.
    int request(uint8_t type, uint8_t number, uint16_t index)
    {
        Urb urb;
        urb.setup = {type, number, 0, index, 0};
        scheduler_.submit(std::move(urb));
        assert_true(scheduler_.step());
        return scheduler_.take_completed().at(0).status;
    }

    // What a transfer that is offered now ends with at once; 1: it waits.
    int outcome_of_a_read()
    {
        offer_transfer();
        const bool did = scheduler_.step();
        const std::vector<Urb> ended = scheduler_.take_completed();
        scheduler_.discard(0);
        scheduler_.take_completed();
        return did && !ended.empty() ? ended[0].status : 1;
    }

    void ticks(uint64_t count)
    {
        for (uint64_t i = 0; i < count; i++) {
            runner_.tick(tick_++, fields_.data());
        }
    }

    void offer_transfer()
    {
        Urb urb;
        urb.kind = UrbKind::BULK_IN;
        urb.length = ENOUGH_BYTES;
        scheduler_.submit(std::move(urb));
    }

    // Whatever waits; the transfer is given back.
    void read_all()
    {
        while (rig_->bulk_packet_due()) {
            assert_true(scheduler_.step());
        }
        scheduler_.discard(0);
        for (const Urb &urb : scheduler_.take_completed()) {
            bytes.insert(bytes.end(), urb.data.begin(), urb.data.end());
        }
    }

    void last_tick()
    {
        runner_.last_tick(fields_.data());
    }

    bool may_end() const
    {
        return scheduler_.stop_seen() && runner_.may_end();
    }

    const Rig &rig() const
    {
        return *rig_;
    }

    uint32_t number(size_t frame, size_t field) const
    {
        return whisker_get_u32(&bytes.at(frame * WHISKER_FRAME_BYTES + field));
    }

    size_t frames() const
    {
        return bytes.size() / WHISKER_FRAME_BYTES;
    }

    Bytes bytes; // read so far

  private:
    std::unique_ptr<Rig> rig_;
    UrbScheduler scheduler_;
    FaultLog log_;
    TickRunner runner_;
    std::array<sim_field, LANES> fields_{};
    uint64_t tick_ = 0;
};

// Ticks without a reader, all that waits read, and again.
void overflow_twice(Level level)
{
    Host host(level);
    host.control(1);
    uint32_t dropped = 0;
    for (unsigned i = 0; i < 2; i++) {
        host.ticks(TICKS);
        assert_true(host.rig().frames_dropped() > dropped + TICKS / 2);
        dropped = host.rig().frames_dropped();
        host.offer_transfer();
        host.read_all();
        assert_true(host.rig().frame_bytes_waiting() < WHISKER_LIMIT_BULK_PACKET);
    }
    const size_t last = host.frames() - 1;
    assert_int_equal(host.number(last, WHISKER_FRAME_HEADER_SEQUENCE) - last,
                     host.number(last, WHISKER_FRAME_HEADER_DROPPED));
    assert_int_equal(host.number(last, WHISKER_FRAME_HEADER_TICK), host.number(last, WHISKER_FRAME_HEADER_SEQUENCE));
}

// The last tick waits until its frame can have room, and then nothing but what was dropped is missing.
void stopped_when_full(Level level)
{
    Host host(level);
    host.control(1);
    host.ticks(TICKS);
    host.control(0);
    assert_false(host.may_end());
    host.offer_transfer();
    assert_true(host.may_end());
    host.last_tick();
    host.read_all();
    assert_false(host.rig().running());
    assert_int_equal(host.rig().frame_bytes_waiting(), 0);
    assert_int_equal(host.frames() + host.rig().frames_dropped(), TICKS);
    assert_int_equal(host.number(host.frames() - 1, WHISKER_FRAME_HEADER_TICK), TICKS - 1);
    assert_true(host.bytes.at((host.frames() - 1) * WHISKER_FRAME_BYTES + WHISKER_FRAME_HEADER_FLAGS) &
                WHISKER_FRAME_FLAG_LAST);
}

// The bridge counts dropped frames anew from each start.
void started_again_after_an_overflow(Level level)
{
    Host host(level);
    for (unsigned i = 0; i < 2; i++) {
        host.control(1);
        host.ticks(TICKS);
        host.control(0);
        host.offer_transfer();
        host.last_tick();
        host.read_all();
        assert_int_equal(host.rig().frame_bytes_waiting(), 0);
    }
}

template <void (*TEST)(Level)> void at_both_levels(void **)
{
    TEST(Level::RTL);
    TEST(Level::MIXED);
}

// A host that has halted an idle endpoint gets that answer at its next read, not when the next frame comes.
void a_halted_endpoint_answers_though_it_has_nothing(void **)
{
    constexpr uint8_t TO_ENDPOINT = 0x02, TO_INTERFACE = 0x01, CLEAR = 1, SET = 3, SET_INTERFACE = 11;
    for (const Level level : {Level::RTL, Level::MIXED}) {
        Host host(level);
        assert_int_equal(host.outcome_of_a_read(), 1);
        assert_int_equal(host.request(TO_ENDPOINT, SET, WHISKER_LIMIT_USB_BULK_IN), 0);
        assert_int_equal(host.outcome_of_a_read(), -EPIPE);
        assert_int_equal(host.outcome_of_a_read(), -EPIPE);
        assert_int_equal(host.request(TO_ENDPOINT, CLEAR, WHISKER_LIMIT_USB_BULK_IN), 0);
        assert_int_equal(host.outcome_of_a_read(), 1);
        assert_int_equal(host.request(TO_ENDPOINT, SET, WHISKER_LIMIT_USB_BULK_IN), 0);
        assert_int_equal(host.request(TO_INTERFACE, SET_INTERFACE, WHISKER_LIMIT_USB_BULK_INTERFACE), 0);
        assert_int_equal(host.outcome_of_a_read(), 1);
    }
}

} // namespace

int main()
{
    const CMUnitTest tests[] = {
        cmocka_unit_test(at_both_levels<overflow_twice>),
        cmocka_unit_test(at_both_levels<stopped_when_full>),
        cmocka_unit_test(at_both_levels<started_again_after_an_overflow>),
        cmocka_unit_test(a_halted_endpoint_answers_though_it_has_nothing),
    };
    return cmocka_run_group_tests(tests, nullptr, nullptr);
}
