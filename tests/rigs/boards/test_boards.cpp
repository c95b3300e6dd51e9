// Boards from their pins: a kernel's enumeration, a run, every lane's record in its place; a PHY whose clock hangs;
// faults drawn at random, each of which must be noticed. `test_boards FAULTS SEED TICKS`: more faults, longer
// runs, each in real time on its bus.
#include "cmocka_cpp.h"

#include <cstdlib>
#include <set>
#include <stdexcept>

#include "board_device.h"
#include "full_speed_board.h"
#include "trial.h"

using namespace bridge_sim;

namespace
{

constexpr uint64_t MS = 60000; // cycles
unsigned faults = 3;           // of each board
uint64_t seed = 1;
uint64_t ticks = 4; // of a run

// Register 0x39 of the USB3343: D+ and D- swapped, as Cynthion has them.
const BoardTraits USB3300 = {{}, true};
const BoardTraits CYNTHION = {{0, 0, false, 0x39, 0x06}, false};

enum { USB3300_BOARD, CYNTHION_BOARD, TANG, ULX3S }; // in BOARDS
const Kind BOARDS[] = {
    {"usb3300_board", BusSpeed::HIGH, false, true,
     [](NodeBus &nodes, const BoardFault &fault) {
         return std::make_unique<BoardDevice>(make_usb3300_board(), USB3300, nodes, fault);
     }},
    {"cynthion", BusSpeed::HIGH, true, true,
     [](NodeBus &nodes, const BoardFault &fault) {
         return std::make_unique<BoardDevice>(make_cynthion(), CYNTHION, nodes, fault);
     }},
    {"tang_primer_20k", BusSpeed::HIGH, false, true,
     [](NodeBus &nodes, const BoardFault &fault) {
         return std::make_unique<BoardDevice>(make_tang(), USB3300, nodes, fault);
     }},
    {"ulx3s", BusSpeed::FULL, false, true,
     [](NodeBus &nodes, const BoardFault &fault) {
         return std::make_unique<FullSpeedBoard>(nodes, fault.kind == BoardFault::Kind::SWAPPED);
     }},
};

void every_board_enumerates_and_runs(void **)
{
    for (const Kind &kind : BOARDS) {
        assert_string_equal(tried(kind, {}, ticks).c_str(), "");
    }
}

BoardDevice &with_phy(Trial &trial)
{
    return dynamic_cast<BoardDevice &>(trial.board());
}

// The device goes when its clock does, and comes back as after power-up.
void a_phy_whose_clock_hangs_is_reset(void **)
{
    const Kind &kind = BOARDS[USB3300_BOARD];
    Trial trial(kind, {});
    trial.enumerated();
    assert_int_equal(with_phy(trial).resets(), 0);
    with_phy(trial).hang();
    for (uint64_t i = 0; i < 60 * MS && with_phy(trial).resets() == 0; i++) {
        with_phy(trial).cycle();
    }
    assert_int_equal(with_phy(trial).resets(), 1);
    assert_int_equal(with_phy(trial).leds(), LED_ERROR);
    trial.host().idle(MS);
    trial.enumerated();
    trial.runs(ticks);
    assert_int_equal(with_phy(trial).resets(), 1);
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
void one_led_reports_all(void **)
{
    Trial trial(BOARDS[USB3300_BOARD], {});
    BoardDevice &board = with_phy(trial);
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

// With a host that does not read, a run's frames are dropped once the FIFO is full; the next run begins without an
// error.
void a_dropped_frame_lights_the_error_led(void **)
{
    constexpr uint64_t FULL = WHISKER_LIMIT_FIFO_BYTES / WHISKER_FRAME_BYTES * WHISKER_LIMIT_TICK_PERIOD_MIN;
    constexpr uint64_t MICROFRAME = MS / 8;
    constexpr uint8_t RUNS = LED_PHY | LED_CONFIGURED | LED_RUN;
    Trial trial(BOARDS[CYNTHION_BOARD], {});
    trial.enumerated();
    trial.begin(WHISKER_LIMIT_TICK_PERIOD_MIN);
    for (uint64_t passed = 0; passed < FULL + FULL / 2; passed += MICROFRAME) {
        trial.shows(RUNS | (passed < FULL ? 0 : trial.board().leds() & LED_ERROR));
        trial.host().start_of_frame();
        trial.host().idle(MICROFRAME);
    }
    trial.shows(RUNS | LED_ERROR);
    trial.end();
    Bytes packet;
    for (uint64_t n = 0; n < 2 * FULL / WHISKER_LIMIT_TICK_PERIOD_MIN && (trial.board().leds() & LED_RUN); n++) {
        trial.host().in(BULK, WHISKER_LIMIT_BULK_PACKET, packet); // the last frame waits for room in the FIFO
        trial.host().idle(LED_DELAY);
    }
    trial.shows(LED_PHY | LED_CONFIGURED | LED_ERROR);
    trial.begin();
    trial.shows(RUNS);
}

// A full-speed board that a host would take for one below its top speed shows a device qualifier, or is deaf for some
// ms after a reset while it chirps.
void a_full_speed_board_has_no_other_speed(void **)
{
    constexpr SetupRequest GET_QUALIFIER = {0x80, 6, 0x0600, 0, 10};
    constexpr SetupRequest GET_OTHER_SPEED = {0x80, 6, 0x0700, 0, 9};
    constexpr uint64_t SHORT_RESET = MS / 50;
    Trial trial(BOARDS[ULX3S], {});
    trial.enumerated();
    Bytes data;
    assert_true(control_transfer(trial.host(), GET_QUALIFIER, data) == Outcome::STALL);
    assert_true(control_transfer(trial.host(), GET_OTHER_SPEED, data) == Outcome::STALL);
    trial.board().in.line_state = LINE_SE0;
    for (const uint64_t until = trial.board().cycles + SHORT_RESET; trial.board().cycles < until;) {
        trial.board().cycle();
    }
    trial.host().set_address(0);
    trial.host().idle(SHORT_RESET);
    assert_true(control_transfer(trial.host(), {0x80, 6, 0x0100, 0, 18}, data) == Outcome::OK);
}

void every_fault_is_noticed(void **)
{
    std::mt19937_64 generator(seed);
    std::set<std::string> drawn;
    const BoardFault swapped = {BoardFault::Kind::SWAPPED, Wire::DATA, Wire::DATA, 0, 1}; // D+ and D-
    assert_string_not_equal(tried(BOARDS[ULX3S], swapped, ticks).c_str(), "");
    for (const Kind &kind : {BOARDS[USB3300_BOARD], BOARDS[CYNTHION_BOARD], BOARDS[TANG]}) {
        for (unsigned n = 0; n < faults;) {
            const BoardFault fault = BoardFault::draw(generator, LANES, kind.polarity);
            const std::string name = std::string(kind.name) + ": " + fault.name();
            if (!drawn.insert(name).second) {
                continue;
            }
            const std::string seen = tried(kind, fault, ticks);
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
        cmocka_unit_test(one_led_reports_all),
        cmocka_unit_test(a_dropped_frame_lights_the_error_led),
        cmocka_unit_test(a_full_speed_board_has_no_other_speed),
        cmocka_unit_test(every_fault_is_noticed),
    };
    return cmocka_run_group_tests(tests, nullptr, nullptr);
}
