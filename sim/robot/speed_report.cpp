#include "speed_report.h"

#include <cerrno>
#include <cinttypes>
#include <cstring>
#include <stdexcept>

#include "whisker_protocol.h"

namespace bridge_sim
{

double Speed::simulated_s() const
{
    return static_cast<double>(ticks) * WHISKER_LIMIT_TICK_PERIOD / WHISKER_LIMIT_CLOCK_HZ;
}

double Speed::realtime_factor() const
{
    return wall_s > 0 ? simulated_s() / wall_s : 0;
}

double Speed::cycles_per_tick() const
{
    return ticks > 0 ? static_cast<double>(cycles) / static_cast<double>(ticks) : 0;
}

namespace
{

std::string usb_counts(const FaultLog &faults)
{
    std::string text;
    for (unsigned kind = 0; kind < USB_FAULT_KINDS; kind++) {
        const auto usb_kind = static_cast<UsbFaultKind>(kind);
        text += std::string(kind ? ", " : "") + "\"" + fault_name(usb_kind) +
                "\": " + std::to_string(faults.usb_count(usb_kind));
    }
    return text;
}

std::string seconds_text(const std::vector<uint64_t> &seconds)
{
    std::string text;
    for (const uint64_t ticks : seconds) {
        text += (text.empty() ? "" : ", ") + std::to_string(ticks);
    }
    return text;
}

} // namespace

void write_speed_report(const std::string &path, const Speed &speed, const FaultLog &faults)
{
    if (path.empty()) {
        return;
    }
    FILE *file = std::fopen(path.c_str(), "wx");
    if (!file) {
        throw std::runtime_error("cannot write '" + path + "': " + std::strerror(errno) + "; choose another name");
    }
    std::fprintf(file, "{\"ticks\": %" PRIu64 ", \"simulated_s\": %.4f, \"wall_s\": %.4f, \"realtime_factor\": %.4f,\n",
                 speed.ticks, speed.simulated_s(), speed.wall_s, speed.realtime_factor());
    std::fprintf(file, " \"cycles\": %" PRIu64 ", \"cycles_per_tick\": %.2f, \"lanes_populated\": %zu,\n", speed.cycles,
                 speed.cycles_per_tick(), speed.lanes_populated);
    std::fprintf(file, " \"rtl_ticks\": [%s],\n", seconds_text(speed.rtl_ticks).c_str());
    std::fprintf(file, " \"pairs_injected\": %zu, \"usb_faults_injected\": %" PRIu64 ", \"usb_faults\": {%s}}\n",
                 faults.pairs().size(), faults.usb_count(), usb_counts(faults).c_str());
    std::fclose(file);
}

} // namespace bridge_sim
