// bridge-pace PERIOD TICKS [REST]: 28 lanes with a tick every PERIOD cycles, a host that rests REST cycles after each
// transaction; prints what came of it as JSON.
#include <cinttypes>
#include <cstdio>
#include <cstdlib>
#include <exception>

#include "paced_bridge.h"

namespace
{

int run(uint64_t period, uint64_t ticks, uint64_t rest)
{
    const bridge_sim::PaceResult result = bridge_sim::run_paced(period, ticks, rest);
    std::printf("{\"period\": %" PRIu64 ", \"asked\": %" PRIu64 ", \"frames\": %" PRIu64 ", \"bad_records\": %" PRIu64
                ", \"naks\": %" PRIu64 ", \"cycles\": %" PRIu64 "}\n",
                period, result.asked, result.frames, result.bad, result.naks, result.cycles);
    return result.sustained() ? 0 : 1;
}

} // namespace

int main(int argc, char **argv)
{
    const uint64_t period = argc > 2 ? std::strtoull(argv[1], nullptr, 10) : 0;
    if (period == 0) {
        std::fprintf(stderr, "bridge-pace: give cycles per tick and a number of ticks, e.g. bridge-pace 4000 2000\n");
        return 2;
    }
    try {
        return run(period, std::strtoull(argv[2], nullptr, 10), argc > 3 ? std::strtoull(argv[3], nullptr, 10) : 0);
    } catch (const std::exception &error) {
        std::fprintf(stderr, "bridge-pace: %s\n", error.what());
        return 1;
    }
}
