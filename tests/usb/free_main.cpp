// bridge-free TICKS: 28 lanes on the bridge's own divider, in both ways of sending; prints as JSON how long frames take
// from SYNC to the end of their packet, and of their transfer by the library's batch, and how fast a bridge can be set.
#include <algorithm>
#include <cinttypes>
#include <cstdio>
#include <cstdlib>
#include <exception>

#include "ticking_bridge.h"

using namespace bridge_sim;

namespace
{

constexpr double CYCLES_PER_US = WHISKER_LIMIT_CLOCK_HZ / 1e6;
constexpr size_t BATCHES[] = {2, 4};

void print_times(const char *name, std::vector<uint64_t> cycles)
{
    std::sort(cycles.begin(), cycles.end());
    std::printf("\"%s\": {\"median_us\": %.1f, \"worst_us\": %.1f}", name,
                static_cast<double>(cycles[cycles.size() / 2]) / CYCLES_PER_US,
                static_cast<double>(cycles.back()) / CYCLES_PER_US);
}

// Of whole transfers: the run's last one may have been cut short.
void print_run(const RunSettings &settings, uint64_t ticks)
{
    const BridgeRun run = run_bridge(settings, ticks);
    uint64_t shortest = UINT64_MAX, longest = 0;
    for (size_t i = 1; i < run.syncs.size(); i++) {
        shortest = std::min(shortest, run.syncs[i] - run.syncs[i - 1]);
        longest = std::max(longest, run.syncs[i] - run.syncs[i - 1]);
    }
    std::printf("{\"sck_divider\": %u, \"word_gap\": %u, \"tick_period\": %" PRIu32 ", \"every_frame\": %s, "
                "\"frames\": %zu, \"bad_records\": %" PRIu64 ", \"sync_shortest\": %" PRIu64
                ", \"sync_longest\": %" PRIu64 ", ",
                settings.sck_divider, settings.word_gap, settings.tick_period, settings.options ? "true" : "false",
                run.packets.size(), run.bad, shortest, longest);
    print_times("packet", run.packets);
    for (const size_t batch : BATCHES) {
        std::printf(", ");
        print_times(batch == 2 ? "batch_2" : "batch_4", run.transfers(batch));
    }
    std::printf("}");
}

void print_all(uint64_t ticks)
{
    const char *before = "[";
    for (const bool every : {false, true}) {
        for (const bool fast : {false, true}) {
            RunSettings settings = fast ? RunSettings::fastest() : RunSettings();
            settings.options = every ? WHISKER_CONTROL_OPTION_EVERY_FRAME : 0;
            std::printf("%s", before);
            print_run(settings, ticks);
            before = ", ";
            settings.tick_period = WHISKER_LIMIT_TICK_PERIOD_MIN;
            std::printf(", ");
            print_run(settings, ticks);
        }
    }
    std::printf("]\n");
}

} // namespace

int main(int argc, char **argv)
{
    const uint64_t ticks = argc > 1 ? std::strtoull(argv[1], nullptr, 10) : 0;
    if (ticks < 4) {
        std::fprintf(stderr, "bridge-free: give a number of ticks, 4 or more, e.g. bridge-free 400\n");
        return 2;
    }
    try {
        print_all(ticks);
        return 0;
    } catch (const std::exception &error) {
        std::fprintf(stderr, "bridge-free: %s\n", error.what());
        return 1;
    }
}
