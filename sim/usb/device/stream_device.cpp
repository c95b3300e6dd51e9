#include "stream_device.h"

#include <algorithm>

namespace bridge_sim
{

uint64_t StreamDevice::taken() const
{
    return taken_;
}

uint64_t StreamDevice::restarts() const
{
    return restarts_;
}

unsigned StreamDevice::slowest_answer() const
{
    return slowest_;
}

void StreamDevice::answered_after(unsigned waited)
{
    const bool high_speed = out.xcvr_select == 0 && out.op_mode == 0; // else a full-speed packet, or a chirp
    slowest_ = high_speed ? std::max(slowest_, waited) : slowest_;
}

void StreamDevice::move(bool moved, bool restart)
{
    taken_ += moved ? 1u : 0u;
    if (restart) {
        restarts_ += restarting_ ? 0u : 1u;
        taken_ = 0;
    }
    restarting_ = restart;
}

} // namespace bridge_sim
