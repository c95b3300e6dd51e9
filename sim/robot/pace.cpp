#include "pace.h"

#include <algorithm>
#include <chrono>

#include "whisker_protocol.h"

namespace bridge_sim
{

namespace
{

constexpr double TICK_S = static_cast<double>(WHISKER_LIMIT_TICK_PERIOD) / WHISKER_LIMIT_CLOCK_HZ;
constexpr double SLIP_S = 0.05;          // of lateness that is made up for
constexpr double HOST_PATIENCE_S = 0.05; // more than a host needs that this machine lets run
constexpr double MS_PER_S = 1000;

double now_s()
{
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

} // namespace

Pace::Pace(double factor) : factor_(factor)
{
}

bool Pace::on() const
{
    return factor_ > 0;
}

double Pace::late_s(uint64_t tick) const
{
    return now_s() - origin_s_.value_or(0) - static_cast<double>(tick) * TICK_S / factor_;
}

bool Pace::due(uint64_t tick)
{
    if (!on()) {
        return true;
    }
    if (!origin_s_) {
        origin_s_ = late_s(tick);
    }
    *origin_s_ += std::max(0.0, late_s(tick) - SLIP_S);
    return late_s(tick) >= 0;
}

int Pace::wait_ms(uint64_t tick, int most_ms) const
{
    if (!origin_s_) {
        return most_ms;
    }
    return std::clamp(static_cast<int>(-late_s(tick) * MS_PER_S), 0, most_ms);
}

bool Patience::over(bool takes)
{
    if (takes) {
        since_.reset();
        return false;
    }
    const double now = now_s();
    since_ = since_.value_or(now);
    const bool over = now - *since_ > HOST_PATIENCE_S;
    since_ = over ? now : *since_;
    return over;
}

} // namespace bridge_sim
