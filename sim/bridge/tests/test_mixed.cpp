// Levels mixed in one run against RTL alone: the same fields, faults, orders, settings, stops, pauses of the host, bus
// resets and losses of power; every byte that the host receives is the same. `test_bridge_mixed SEEDS` for more.
#include <cstdlib>

#include "cmocka_cpp.h"
#include "make_rig.h"
#include "tick_runner.h"

namespace
{

using namespace bridge_sim;

constexpr size_t POPULATED = 6, TRANSFERS = 4, TRANSFER_BYTES = 4096;
constexpr uint64_t RTL_TICKS = 300, TICKS = 6000;
constexpr uint64_t PAUSE_TICKS = 100; // more than FIFO and endpoint hold
constexpr uint32_t ALL_LANES = UINT32_MAX >> (32 - LANES);
constexpr uint8_t SET_TYPE = 0x21, SET_REPORT = 9, GET_TYPE = 0xA1, GET_REPORT = 1;
constexpr uint16_t FEATURE = 0x0300;

uint64_t seeds = 4;

// A host and a bridge: what it received, as text.
class Side
{
  public:
    Side(Level level, uint64_t seed, const std::optional<FaultPlan> &plan)
        : rig_(make_rig(level, POPULATED, seed, {}, RTL_TICKS)), scheduler_(*rig_), log_("", ""),
          runner_(*rig_, scheduler_, plan, log_)
    {
        Descriptors descriptors;
        const char *error = nullptr;
        assert_true(rig_->power_on(descriptors, error));
    }

    void request(uint8_t type, uint8_t number, Bytes data, uint8_t id, uint16_t length)
    {
        Urb urb;
        urb.setup = {type, number, static_cast<uint16_t>(FEATURE | id), WHISKER_LIMIT_USB_HID_INTERFACE, length};
        urb.data = std::move(data);
        scheduler_.submit(std::move(urb));
    }

    void run(bool on, uint8_t options, uint32_t lane_mask)
    {
        Bytes report(WHISKER_REPORT_CONTROL_BYTES);
        report[WHISKER_REPORT_CONTROL_ID] = WHISKER_REPORT_ID_CONTROL;
        report[WHISKER_REPORT_CONTROL_WIRE_VERSION] = WHISKER_WIRE_VERSION;
        report[WHISKER_REPORT_CONTROL_RUN] = on;
        report[WHISKER_REPORT_CONTROL_SCK_DIVIDER] = WHISKER_LIMIT_SCK_DIVIDER_MIN;
        report[WHISKER_REPORT_CONTROL_WORD_GAP] = WHISKER_LIMIT_WORD_GAP_MIN;
        report[WHISKER_REPORT_CONTROL_SAMPLE_POINT] = WHISKER_LIMIT_SCK_DIVIDER_MIN - 1;
        report[WHISKER_REPORT_CONTROL_OPTIONS] = options;
        whisker_put_u32(&report[WHISKER_REPORT_CONTROL_LANE_MASK], lane_mask);
        whisker_put_u32(&report[WHISKER_REPORT_CONTROL_TICK_PERIOD], WHISKER_LIMIT_TICK_PERIOD);
        request(SET_TYPE, SET_REPORT, report, WHISKER_REPORT_ID_CONTROL, WHISKER_REPORT_CONTROL_BYTES);
    }

    void tick(uint64_t number, const sim_field *fields)
    {
        offer();
        while (!pausing_ && !runner_.ready()) {
            settle();
            offer();
        }
        runner_.tick(number, fields);
        rtl_ticks_ += rig_->at_rtl();
        take();
    }

    // Of these three each takes what is due first: the levels take it at different moments of a tick.
    void pause(bool pausing)
    {
        settle();
        pausing_ = pausing;
        scheduler_.stay_away(pausing);
    }

    void bus_reset()
    {
        settle();
        Urb urb;
        urb.kind = UrbKind::BUS_RESET;
        scheduler_.submit(std::move(urb));
        settle();
    }

    void power_cycle()
    {
        settle();
        scheduler_.plug(false);
        runner_.unplugged();
        take();
        Descriptors descriptors;
        const char *error = nullptr;
        assert_true(rig_->power_cycle(descriptors, error));
        scheduler_.plug(true);
    }

    void end(const sim_field *fields)
    {
        run(false, 0, ALL_LANES);
        settle();
        last_tick(fields);
        request(GET_TYPE, GET_REPORT, {}, WHISKER_REPORT_ID_COUNTERS, 255);
        settle();
        runner_.check_usb();
    }

    void last_tick(const sim_field *fields)
    {
        runner_.last_tick(fields);
        settle();
    }

    void settle()
    {
        while (scheduler_.step()) {
        }
        take();
    }

    const std::string &frames() const
    {
        return frames_;
    }

    // To all other requests, each with its status.
    const std::string &answers() const
    {
        return answers_;
    }

    uint64_t rtl_ticks() const
    {
        return rtl_ticks_;
    }

  private:
    void offer()
    {
        while (submitted_ < TRANSFERS) {
            Urb urb;
            urb.kind = UrbKind::BULK_IN;
            urb.length = TRANSFER_BYTES;
            scheduler_.submit(std::move(urb));
            submitted_++;
        }
    }

    void take()
    {
        for (const Urb &urb : scheduler_.take_completed()) {
            const bool bulk = urb.kind == UrbKind::BULK_IN;
            submitted_ -= bulk ? 1 : 0;
            std::string &of = bulk ? frames_ : answers_;
            of.append(urb.data.begin(), urb.data.end());
            answers_ += bulk ? "" : std::to_string(urb.status) + "\n";
        }
    }

    std::unique_ptr<Rig> rig_;
    UrbScheduler scheduler_;
    FaultLog log_;
    TickRunner runner_;
    std::string frames_, answers_;
    size_t submitted_ = 0;
    uint64_t rtl_ticks_ = 0;
    bool pausing_ = false;
};

class Pair
{
  public:
    // Odd seeds draw faults. Even ones have a host that pauses, resets the bus or loses the device: not both, for while
    // a fault keeps the host away it cannot take what is due first.
    explicit Pair(uint64_t seed)
        : faults_(seed % 2), plan_(faults_ ? std::optional(FaultPlan(seed, POPULATED, TICKS)) : std::nullopt),
          sides_{Side(Level::RTL, seed, plan_), Side(Level::MIXED, seed, plan_)}, draw_(seed)
    {
    }

    // Runs of all options, each disturbed in another way in its midst, with orders to the nodes now and then.
    void run()
    {
        static constexpr struct {
            uint8_t options;
            uint32_t lane_mask;
            void (Side::*disturb)();
        } RUNS[] = {{0, ALL_LANES, nullptr},
                    {WHISKER_CONTROL_OPTION_EVERY_FRAME, 0x0F00015, &Side::bus_reset},
                    {WHISKER_CONTROL_OPTION_PATTERN, ALL_LANES ^ 2, &Side::power_cycle}};
        uint64_t number = 0;
        for (const auto &run : RUNS) {
            const auto start = [&run](Side &side) {
                side.run(true, run.options, run.lane_mask);
                side.settle();
            };
            both(start);
            ticks(number, TICKS / 6);
            if (run.disturb && !faults_) {
                both([&run](Side &side) { (side.*run.disturb)(); });
                both(start);
            } else {
                both([](Side &side) {
                    side.run(true, WHISKER_CONTROL_OPTION_PATTERN, 3);
                    side.settle();
                });
            }
            ticks(number, TICKS / 6);
            both([this](Side &side) { side.end(fields_.data()); });
            compare();
        }
    }

    // Runs of 1, 2, ... ticks, each stopped in the midst of its last but one: also where bytes were about to take over.
    void stop_within_ticks(uint64_t runs)
    {
        uint64_t number = 0;
        for (uint64_t count = 1; count <= runs; count++) {
            both([](Side &side) {
                side.run(true, 0, ALL_LANES);
                side.settle();
            });
            ticks(number, count);
            both([this, number](Side &side) {
                side.run(false, 0, ALL_LANES);
                side.tick(number, fields_.data());
                side.last_tick(fields_.data());
            });
            number++;
            compare();
        }
    }

    uint64_t rtl_ticks(size_t side) const
    {
        return sides_[side].rtl_ticks();
    }

  private:
    void compare()
    {
        assert_true(sides_[0].frames() == sides_[1].frames());
        assert_true(sides_[0].answers() == sides_[1].answers());
    }

    template <typename Action> void both(Action action)
    {
        for (Side &side : sides_) {
            action(side);
        }
    }

    void ticks(uint64_t &number, uint64_t count)
    {
        for (const uint64_t until = number + count; number < until; number++) {
            if (!faults_ && (until - number == 2 * PAUSE_TICKS || until - number == PAUSE_TICKS)) {
                both([pausing = until - number > PAUSE_TICKS](Side &side) { side.pause(pausing); });
            }
            one_tick(number);
        }
    }

    void one_tick(uint64_t number)
    {
        for (sim_field &field : fields_) {
            field.alpha_deg += static_cast<double>(draw_() % 100) / 10 - 4.95;
            field.beta_deg -= field.alpha_deg / 100;
        }
        if (draw_() % 700 == 0) {
            Bytes order(WHISKER_REPORT_SERVICE_BYTES);
            order[WHISKER_REPORT_SERVICE_ID] = WHISKER_REPORT_ID_SERVICE;
            order[WHISKER_REPORT_SERVICE_WIRE_VERSION] = WHISKER_WIRE_VERSION;
            order[WHISKER_REPORT_SERVICE_COMMAND] = WHISKER_SERVICE_COMMAND_INFO;
            both([&order](Side &side) {
                side.request(SET_TYPE, SET_REPORT, order, WHISKER_REPORT_ID_SERVICE, WHISKER_REPORT_SERVICE_BYTES);
            });
        } else if (draw_() % 700 == 0) {
            both([](Side &side) { side.request(GET_TYPE, GET_REPORT, {}, WHISKER_REPORT_ID_ANSWERS, 255); });
        }
        both([this, number](Side &side) { side.tick(number, fields_.data()); });
    }

    bool faults_;
    std::optional<FaultPlan> plan_;
    Side sides_[2];
    std::array<sim_field, LANES> fields_{};
    std::mt19937_64 draw_;
};

void test_levels_mixed_give_the_same_bytes(void **)
{
    for (uint64_t seed = 1; seed <= seeds; seed++) {
        Pair pair(seed);
        pair.run();
        assert_int_equal(pair.rtl_ticks(0), TICKS);
        assert_true(pair.rtl_ticks(1) >= RTL_TICKS);
        assert_true(pair.rtl_ticks(1) < TICKS / 2);
    }
}

void test_a_stop_that_comes_within_a_tick_ends_the_run_after_the_next(void **)
{
    Pair pair(0);
    pair.stop_within_ticks(40);
    assert_true(pair.rtl_ticks(1) < pair.rtl_ticks(0)); // bytes had their turn
}

} // namespace

int main(int argc, char **argv)
{
    if (argc == 2) {
        seeds = std::strtoull(argv[1], nullptr, 10);
    }
    const CMUnitTest tests[] = {
        cmocka_unit_test(test_levels_mixed_give_the_same_bytes),
        cmocka_unit_test(test_a_stop_that_comes_within_a_tick_ends_the_run_after_the_next),
    };
    return cmocka_run_group_tests(tests, nullptr, nullptr);
}
