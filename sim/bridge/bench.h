// The rig without host software: an internal host starts the bridge, reads the bulk endpoint, checks every frame
// against the fields that were sent, and stops it. Measures speed, and is the end-to-end test of RTL and nodes.
#pragma once

#include <array>
#include <vector>

#include "frame_check.h"
#include "tick_runner.h"

namespace bridge_sim
{

struct BenchSettings {
    uint64_t ticks = 400;
    size_t populated = 6;
    uint64_t seed = 1;
    uint8_t sck_divider = WHISKER_LIMIT_SCK_DIVIDER_MIN;
    uint8_t word_gap = WHISKER_LIMIT_WORD_GAP_MIN;
    uint8_t sample_point = WHISKER_LIMIT_SCK_DIVIDER_MIN - 1;
    bool faults = false;
    Level level = Level::RTL;
    uint64_t rtl_ticks = 0; // at level mixed: the first ones
    std::string lane_fault_path;
    std::string usb_fault_path;
};

struct BenchResult {
    uint64_t ticks = 0;
    uint64_t frames = 0;
    uint64_t cycles = 0; // while running
    double wall_s = 0;
};

class Bench
{
  public:
    explicit Bench(const BenchSettings &settings);

    // Power on, start, ticks, stop, and a comparison of the faults reported with those injected. Throws
    // std::runtime_error with one line on the first thing that is not as it should be.
    BenchResult run();

    // The parts, for tests that go their own way.
    void power_on();
    void start();
    void ticks(uint64_t count);
    void stop();

    // Another bus reset and enumeration in the midst of a run, which that ends.
    void enumerate_again();

    // Every pair (lane, tick) reported bad was injected, and the other way round, with the code its fault must have.
    void check_faults() const;

    // Irregularities on the wire that no injected fault explains.
    void check_usb() const;

    uint64_t frames_of_run() const; // since the latest start
    const FaultLog &faults() const;

  private:
    void send(uint8_t run);
    void submit_transfer();
    void take_transfers();
    void wait_until_ready();
    void draw_fields();
    void check_frame(const CheckedFrame &frame);
    void check_lane(const CheckedFrame &frame, size_t lane);

    BenchSettings settings_;
    std::unique_ptr<Rig> rig_;
    UrbScheduler scheduler_;
    FaultLog log_;
    TickRunner runner_;
    FrameCheck check_;
    std::mt19937_64 generator_;
    std::array<sim_field, LANES> fields_{};
    std::vector<std::array<sim_field, LANES>> sent_;           // by tick of this run
    std::map<std::pair<size_t, uint64_t>, uint16_t> reported_; // status of each bad record
    uint64_t tick_ = 0;                                        // of this run
    bool reset_ = false;                                       // the bus was, before this run
    size_t submitted_ = 0;                                     // bulk transfers waiting
};

} // namespace bridge_sim
