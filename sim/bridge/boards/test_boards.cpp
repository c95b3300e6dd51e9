// Boards from their pins: a kernel's enumeration, a run, every lane's record in its place; a PHY whose clock hangs;
// faults drawn at random, each of which must be noticed. `test_boards FAULTS SEED` draws more.
#include "cmocka_cpp.h"

#include <cstdlib>
#include <set>
#include <stdexcept>

#include "board_device.h"
#include "frame_check.h"
#include "usb_control.h"

using namespace bridge_sim;

namespace
{

constexpr uint64_t TICKS = 4;
constexpr uint64_t MS = 60000;                                       // cycles
constexpr uint64_t PATIENCE = 2 * TICKS * WHISKER_LIMIT_TICK_PERIOD; // cycles of a run
constexpr uint8_t BULK = WHISKER_LIMIT_USB_BULK_IN & 0xF;
constexpr size_t PACKET = WHISKER_LIMIT_BULK_PACKET;

struct Kind {
    BoardTraits traits;
    std::unique_ptr<BoardTop> (*make)();
};
// Register 0x39 of the USB3343: D+ and D- swapped, as Cynthion has them.
const Kind BOARDS[] = {{{"usb3300_board", {}, true}, make_usb3300_board},
                       {{"cynthion", {0, 0, false, 0x39, 0x06}, false}, make_cynthion}};
unsigned faults = 3; // of each board
uint64_t seed = 1;

class Trial
{
  public:
    Trial(const Kind &kind, const BoardFault &fault) : device_(kind.make(), kind.traits, nodes_, fault)
    {
        nodes_.power_on();
        for (size_t lane = 0; lane < LANES; lane++) {
            fields_[lane] = {static_cast<double>(lane) - 14.0, 7.0 - 0.5 * static_cast<double>(lane)};
        }
        nodes_.set_fields(fields_.data());
    }
    BoardDevice &device()
    {
        return device_;
    }
    UsbHost &host()
    {
        return host_;
    }
    void enumerated()
    {
        Descriptors descriptors;
        const char *error = nullptr;
        if (!enumerate(host_, descriptors, error)) {
            throw std::runtime_error(error);
        }
    }
    // A run, begun and ended; throws std::runtime_error with what is wrong.
    void runs()
    {
        require(device_.bus_is_idle(), "the nodes' lines are not idle before a run");
        require(!device_.led(), "the LED is lit before a run");
        check_.expect_start(true);
        control(1);
        while (check_.frames() < TICKS) {
            read();
        }
        require(device_.led(), "the LED is dark in a run");
        hears_orders();
        control(0);
        while (!check_.ended()) {
            read();
        }
        require(host_.counters().unexplained == 0, "transactions went wrong");
    }

  private:
    static void require(bool ok, const char *what)
    {
        if (!ok) {
            throw std::runtime_error(what);
        }
    }
    void set_report(Bytes report, uint16_t size)
    {
        report.resize(size);
        const auto value = static_cast<uint16_t>(0x0300 | report[0]);
        require(control_transfer(host_, {0x21, 9, value, WHISKER_LIMIT_USB_HID_INTERFACE, size}, report) == Outcome::OK,
                "a report is not taken");
        limit_ = device_.cycles + PATIENCE;
    }
    void control(uint8_t run)
    {
        Bytes report = {WHISKER_REPORT_ID_CONTROL, WHISKER_WIRE_VERSION, run, 6, 30, 3};
        report.resize(WHISKER_REPORT_CONTROL_BYTES);
        whisker_put_u32(&report[WHISKER_REPORT_CONTROL_LANE_MASK], UINT32_MAX >> (32 - LANES));
        whisker_put_u32(&report[WHISKER_REPORT_CONTROL_TICK_PERIOD], WHISKER_LIMIT_TICK_PERIOD);
        set_report(report, WHISKER_REPORT_CONTROL_BYTES);
    }
    // Each node tells its serial number, and the order reached it by MOSI alone.
    void hears_orders()
    {
        for (const uint8_t command : {WHISKER_SERVICE_COMMAND_INFO, WHISKER_SERVICE_COMMAND_POLL}) {
            set_report({WHISKER_REPORT_ID_SERVICE, WHISKER_WIRE_VERSION, command, WHISKER_INFO_SERIAL},
                       WHISKER_REPORT_SERVICE_BYTES);
            for (const uint64_t until = check_.frames() + 2; check_.frames() < until;) {
                read();
            }
        }
        Bytes answers;
        require(control_transfer(host_,
                                 {0xA1, 1, 0x0300 | WHISKER_REPORT_ID_ANSWERS, WHISKER_LIMIT_USB_HID_INTERFACE,
                                  WHISKER_REPORT_ANSWERS_BYTES},
                                 answers) == Outcome::OK,
                "the answers cannot be read");
        for (size_t lane = 0; lane < LANES; lane++) {
            const uint8_t *answer = &answers.at(WHISKER_REPORT_ANSWERS_ANSWER + 6 * lane);
            require(whisker_get_u16(answer) == lane + 1 &&
                        whisker_get_u16(answer + 4) >> WHISKER_STATUS_CODE_SHIFT == WHISKER_CODE_ANSWER,
                    "a node does not hear orders");
        }
    }
    void read()
    {
        if (host_.in(BULK, PACKET, packet_) == Outcome::OK) {
            check_.take(packet_);
        }
        host_.idle(PACKET);
        require(device_.cycles < limit_, "frames do not come");
    }
    void judge(const CheckedFrame &frame) const
    {
        for (size_t lane = 0; lane < LANES; lane++) {
            const CheckedRecord &record = frame.lane[lane];
            require(record.status == 0 && record.alpha == sim_counts(fields_[lane].alpha_deg) &&
                        record.beta == sim_counts(fields_[lane].beta_deg),
                    "a record is not its lane's reading");
        }
    }

    NodeBus nodes_{LANES, 1};
    std::array<sim_field, LANES> fields_{};
    BoardDevice device_;
    UsbHost host_{device_};
    FrameCheck check_{[this](const CheckedFrame &frame) { judge(frame); }};
    Bytes packet_;
    uint64_t limit_ = 0;
};

// What a user would see go wrong; empty: nothing.
std::string tried(const Kind &kind, const BoardFault &fault)
{
    try {
        Trial trial(kind, fault);
        trial.enumerated();
        trial.runs();
    } catch (const std::runtime_error &error) {
        return error.what();
    }
    return "";
}

void every_board_enumerates_and_runs(void **)
{
    for (const Kind &kind : BOARDS) {
        assert_string_equal(tried(kind, {}).c_str(), "");
    }
}

// The device goes when its clock does, and comes back as after power-up.
void a_phy_whose_clock_hangs_is_reset(void **)
{
    const Kind &kind = BOARDS[0];
    Trial trial(kind, {});
    trial.enumerated();
    assert_int_equal(trial.device().resets(), 0);
    trial.device().hang();
    for (uint64_t i = 0; i < 60 * MS && trial.device().resets() == 0; i++) {
        trial.device().cycle();
    }
    assert_int_equal(trial.device().resets(), 1);
    trial.host().idle(MS);
    trial.enumerated();
    trial.runs();
    assert_int_equal(trial.device().resets(), 1);
}

void every_fault_is_noticed(void **)
{
    std::mt19937_64 generator(seed);
    std::set<std::string> drawn;
    for (const Kind &kind : BOARDS) {
        for (unsigned n = 0; n < faults;) {
            const BoardFault fault = BoardFault::draw(generator, LANES, kind.traits.phy.swap_register != 0);
            const std::string name = std::string(kind.traits.name) + ": " + fault.name();
            if (!drawn.insert(name).second) {
                continue;
            }
            const std::string seen = tried(kind, fault);
            print_message("%s: %s\n", name.c_str(), seen.empty() ? "NOT NOTICED" : seen.c_str());
            assert_true(!seen.empty());
            n++;
        }
    }
}

} // namespace

int main(int argc, char **argv)
{
    if (argc == 3) {
        faults = static_cast<unsigned>(std::strtoul(argv[1], nullptr, 10));
        seed = std::strtoull(argv[2], nullptr, 10);
    }
    const CMUnitTest tests[] = {
        cmocka_unit_test(every_board_enumerates_and_runs),
        cmocka_unit_test(a_phy_whose_clock_hangs_is_reset),
        cmocka_unit_test(every_fault_is_noticed),
    };
    return cmocka_run_group_tests(tests, nullptr, nullptr);
}
