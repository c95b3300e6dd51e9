// whisker-bridge-sim: the simulated robot as a USB device. See --help.
#include <cinttypes>
#include <cstdio>
#include <cstdlib>
#include <exception>

#include "options.h"
#include "simulation.h"

namespace
{

constexpr int FAILED = 1;

int run_bench(const bridge_sim::Options &options)
{
    bridge_sim::BenchSettings settings = options.link;
    settings.ticks = options.ticks();
    settings.populated = options.lanes_populated;
    settings.seed = options.seed;
    settings.faults = !options.faults.empty();
    settings.lane_fault_path = options.faults;
    settings.usb_fault_path = options.usb_faults;
    bridge_sim::Bench bench(settings);
    const bridge_sim::BenchResult result = bench.run();
    const bridge_sim::Speed speed = {result.ticks, result.cycles, result.wall_s, settings.populated, {}};
    bridge_sim::write_speed_report(options.speed_report, speed, bench.faults());
    std::printf("%" PRIu64 " ticks, %zu lanes populated: every frame as sent; %.1f cycles per tick, %.2f simulated "
                "seconds per second\n",
                result.ticks, settings.populated, speed.cycles_per_tick(), speed.realtime_factor());
    return 0;
}

int run(const bridge_sim::Options &options)
{
    if (options.bench) {
        return run_bench(options);
    }
    bridge_sim::Simulation simulation(options);
    return simulation.run();
}

} // namespace

int main(int argc, char **argv)
{
    bridge_sim::Options options;
    const int wrong = bridge_sim::parse_options(argc, argv, options);
    if (wrong != COMMAND_LINE_READ) {
        return wrong;
    }
    try {
        return run(options);
    } catch (const std::exception &error) {
        std::fprintf(stderr, "%s: %s\n", bridge_sim::PROGRAM, error.what());
        std::fflush(nullptr);
        std::_Exit(FAILED); // a client in the midst of an ioctl has crashed umockdev's exit handlers
    }
}
