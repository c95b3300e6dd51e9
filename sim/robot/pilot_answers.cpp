#include "pilot_answers.h"

#include <cinttypes>
#include <cmath>
#include <cstdio>

namespace bridge_sim
{

namespace
{

uint64_t end_of_block(uint64_t block)
{
    return (block + 1) * DECISION_BLOCK - 1;
}

uint64_t effect_of_block(uint64_t block)
{
    return end_of_block(block) + 1 + DECISION_DELAY;
}

} // namespace

PilotAnswers::PilotAnswers(Answer kind) : kind_(kind)
{
}

bool PilotAnswers::take(const std::string &message)
{
    const bool sound = kind_ == Answer::BASE ? take_base(message) : take_drive(message);
    blocks_ += sound ? 1 : 0;
    return sound;
}

bool PilotAnswers::take_drive(const std::string &message)
{
    uint64_t tick = 0;
    Drive drive{};
    const int items =
        std::sscanf(message.c_str(), "drive %" SCNu64 " %lf %lf", &tick, &drive.v_m_s, &drive.omega_rad_s);
    if (items != 3 || tick != end_of_block(blocks_) || !std::isfinite(drive.v_m_s) ||
        !std::isfinite(drive.omega_rad_s)) {
        return false;
    }
    drives_[effect_of_block(blocks_)] = drive;
    return true;
}

// The number of bytes never falls.
bool PilotAnswers::take_base(const std::string &message)
{
    uint64_t tick = 0;
    uint64_t bytes = 0;
    const int items = std::sscanf(message.c_str(), "base %" SCNu64 " %" SCNu64, &tick, &bytes);
    if (items != 2 || tick != end_of_block(blocks_) || (!bytes_.empty() && bytes < bytes_.rbegin()->second)) {
        return false;
    }
    bytes_[effect_of_block(blocks_)] = bytes;
    return true;
}

std::string PilotAnswers::due() const
{
    const std::string tick = std::to_string(end_of_block(blocks_));
    return kind_ == Answer::BASE ? "base " + tick + " N" : "drive " + tick + " V OMEGA";
}

uint64_t PilotAnswers::ticks_answered() const
{
    return blocks_ * DECISION_BLOCK;
}

bool PilotAnswers::cover(uint64_t tick) const
{
    return tick < effect_of_block(blocks_);
}

std::optional<Drive> PilotAnswers::drive_at(uint64_t tick)
{
    const auto at = drives_.find(tick);
    if (at == drives_.end()) {
        return std::nullopt;
    }
    const Drive drive = at->second;
    drives_.erase(at);
    return drive;
}

uint64_t PilotAnswers::bytes_at(uint64_t tick)
{
    const auto later = bytes_.upper_bound(tick);
    if (later == bytes_.begin()) {
        return 0;
    }
    const auto now = std::prev(later);
    bytes_.erase(bytes_.begin(), now);
    return now->second;
}

bool PilotAnswers::ends_block(uint64_t tick)
{
    return tick == end_of_block(tick / DECISION_BLOCK);
}

} // namespace bridge_sim
