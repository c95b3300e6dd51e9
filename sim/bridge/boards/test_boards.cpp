// Boards from their pins: a kernel's enumeration, a run, every lane's record in its place; a PHY whose clock hangs;
// faults drawn at random, each of which must be noticed. `test_boards FAULTS SEED TICKS`: more faults, longer
// runs, each in real time on its bus.
#include "cmocka_cpp.h"

#include <cstdlib>
#include <set>
#include <stdexcept>

#include "board_device.h"
#include "frame_check.h"
#include "full_speed_board.h"
#include "usb_control.h"

using namespace bridge_sim;

namespace
{

constexpr uint64_t MS = 60000;                               // cycles
constexpr uint64_t PATIENCE = 8 * WHISKER_LIMIT_TICK_PERIOD; // cycles without a frame
constexpr uint64_t LED_DELAY = 200;
constexpr uint8_t BULK = WHISKER_LIMIT_USB_BULK_IN & 0xF;
constexpr size_t FULL_SPEED_PACKET = 64;
unsigned faults = 3; // of each board
uint64_t seed = 1;
uint64_t ticks = 4; // of a run

// Register 0x39 of the USB3343: D+ and D- swapped, as Cynthion has them.
const BoardTraits USB3300 = {{}, true};
const BoardTraits CYNTHION = {{0, 0, false, 0x39, 0x06}, false};

struct Kind {
    const char *name;
    BusSpeed speed;
    bool polarity; // its PHY needs a register written
    std::function<std::unique_ptr<Board>(NodeBus &, const BoardFault &)> make;
};
const Kind BOARDS[] = {
    {"usb3300_board", BusSpeed::HIGH, false,
     [](NodeBus &nodes, const BoardFault &fault) {
         return std::make_unique<BoardDevice>(make_usb3300_board(), USB3300, nodes, fault);
     }},
    {"cynthion", BusSpeed::HIGH, true,
     [](NodeBus &nodes, const BoardFault &fault) {
         return std::make_unique<BoardDevice>(make_cynthion(), CYNTHION, nodes, fault);
     }},
    {"ulx3s", BusSpeed::FULL, false,
     [](NodeBus &nodes, const BoardFault &fault) {
         return std::make_unique<FullSpeedBoard>(nodes, fault.kind == BoardFault::Kind::SWAPPED);
     }},
};

class Trial
{
  public:
    Trial(const Kind &kind, const BoardFault &fault) : speed_(kind.speed), board_(kind.make(nodes_, fault))
    {
        nodes_.power_on();
        for (size_t lane = 0; lane < LANES; lane++) {
            fields_[lane] = {static_cast<double>(lane) - 14.0, 7.0 - 0.5 * static_cast<double>(lane)};
        }
        nodes_.set_fields(fields_.data());
    }
    BoardDevice &with_phy()
    {
        return dynamic_cast<BoardDevice &>(*board_);
    }
    UsbHost &host()
    {
        return host_;
    }
    void enumerated()
    {
        Descriptors descriptors;
        const char *error = nullptr;
        const auto transfer = [this](const SetupRequest &request, Bytes &data) {
            return control_transfer(host_, request, data);
        };
        require(host_.reset(speed_), "no device after a reset");
        tells(LED_PHY);
        if (!configure(transfer, descriptors, error)) {
            throw std::runtime_error(error);
        }
    }
    void begin()
    {
        check_.expect_start(true);
        control(1);
    }
    // What the LEDs show; they follow within some cycles of the oscillator.
    void tells(uint8_t leds)
    {
        host_.idle(LED_DELAY);
        require(board_->leds() == leds, "the LEDs tell something else");
    }
    // A run, begun and ended; throws std::runtime_error with what is wrong.
    void runs()
    {
        require(board_->bus_is_idle(), "the nodes' lines are not idle before a run");
        tells(LED_PHY | LED_CONFIGURED);
        begin();
        while (check_.frames() < ticks) {
            read();
        }
        tells(LED_PHY | LED_CONFIGURED | LED_RUN);
        hears_orders();
        control(0);
        while (!check_.ended()) {
            read();
        }
        tells(LED_PHY | LED_CONFIGURED);
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
        limit_ = board_->cycles + PATIENCE;
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
        const size_t packet = speed_ == BusSpeed::HIGH ? WHISKER_LIMIT_BULK_PACKET : FULL_SPEED_PACKET;
        if (host_.in(BULK, packet, packet_) == Outcome::OK) {
            check_.take(packet_);
        }
        host_.idle(packet);
        require(board_->cycles < limit_, "frames do not come");
    }
    void judge(const CheckedFrame &frame)
    {
        limit_ = board_->cycles + PATIENCE;
        for (size_t lane = 0; lane < LANES; lane++) {
            const CheckedRecord &record = frame.lane[lane];
            require(record.status == 0 && record.alpha == sim_counts(fields_[lane].alpha_deg) &&
                        record.beta == sim_counts(fields_[lane].beta_deg),
                    "a record is not its lane's reading");
        }
    }

    NodeBus nodes_{LANES, 1};
    std::array<sim_field, LANES> fields_{};
    BusSpeed speed_;
    std::unique_ptr<Board> board_;
    UsbHost host_{*board_};
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
    assert_int_equal(trial.with_phy().resets(), 0);
    trial.with_phy().hang();
    for (uint64_t i = 0; i < 60 * MS && trial.with_phy().resets() == 0; i++) {
        trial.with_phy().cycle();
    }
    assert_int_equal(trial.with_phy().resets(), 1);
    assert_int_equal(trial.with_phy().leds(), LED_ERROR);
    trial.host().idle(MS);
    trial.enumerated();
    trial.runs();
    assert_int_equal(trial.with_phy().resets(), 1);
}

// Changes and lit cycles of the only LED, in a time that holds several of its slow blinks.
std::pair<unsigned, unsigned> watched(BoardDevice &board)
{
    constexpr unsigned BLINKS = 4, SLOW = 256 * 24; // cycles: 2^8 of the oscillator's
    unsigned changes = 0, lit = 0;
    bool before = board.led();
    for (unsigned i = 0; i < BLINKS * SLOW; i++) {
        board.cycle();
        changes += board.led() != before;
        lit += board.led();
        before = board.led();
    }
    return {changes, lit * 16 / (BLINKS * SLOW)};
}

// Changes in four slow blinks, and sixteenths of the time in which it is lit.
void one_led_tells_all(void **)
{
    Trial trial(BOARDS[0], {});
    BoardDevice &board = trial.with_phy();
    trial.host().idle(MS);
    assert_true(watched(board) == std::make_pair(8u, 1u)); // flashes: the PHY is set up
    trial.enumerated();
    assert_true(watched(board) == std::make_pair(8u, 8u)); // blinks: configured
    trial.begin();
    trial.host().idle(LED_DELAY);
    assert_true(watched(board) == std::make_pair(0u, 16u)); // lit: a run
    board.hang();
    trial.host().idle(MS);
    assert_true(watched(board) == std::make_pair(64u, 8u)); // blinks fast: error
}

void every_fault_is_noticed(void **)
{
    std::mt19937_64 generator(seed);
    std::set<std::string> drawn;
    const BoardFault swapped = {BoardFault::Kind::SWAPPED, Wire::DATA, Wire::DATA, 0, 1}; // D+ and D-
    assert_string_not_equal(tried(BOARDS[2], swapped).c_str(), "");
    for (const Kind &kind : {BOARDS[0], BOARDS[1]}) {
        for (unsigned n = 0; n < faults;) {
            const BoardFault fault = BoardFault::draw(generator, LANES, kind.polarity);
            const std::string name = std::string(kind.name) + ": " + fault.name();
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
    if (argc == 4) {
        faults = static_cast<unsigned>(std::strtoul(argv[1], nullptr, 10));
        seed = std::strtoull(argv[2], nullptr, 10);
        ticks = std::strtoull(argv[3], nullptr, 10);
    }
    const CMUnitTest tests[] = {
        cmocka_unit_test(every_board_enumerates_and_runs),
        cmocka_unit_test(a_phy_whose_clock_hangs_is_reset),
        cmocka_unit_test(one_led_tells_all),
        cmocka_unit_test(every_fault_is_noticed),
    };
    return cmocka_run_group_tests(tests, nullptr, nullptr);
}
