// What the pilot answers each block of ticks with, and at which tick that takes effect.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

namespace bridge_sim
{

constexpr uint64_t DECISION_BLOCK = 40; // ticks the pilot answers with one message
constexpr uint64_t DECISION_DELAY = 40; // ticks from the end of a block to its answer's effect, besides the one between

struct Drive {
    double v_m_s;
    double omega_rad_s;
};

// What a pilot answers a block with.
enum class Answer { DRIVE, BASE };

class PilotAnswers
{
  public:
    explicit PilotAnswers(Answer kind);

    // Takes the answer to the next block, "drive T V OMEGA" or "base T N". False: that is not the answer due.
    bool take(const std::string &message);

    // The answer due, in words for people.
    std::string due() const;

    // Ticks that the pilot has seen when it has said all that it did.
    uint64_t ticks_answered() const;

    // Has all been answered that takes effect by this tick?
    bool cover(uint64_t tick) const;

    // The command that takes effect at this tick, if one does; it is given once.
    std::optional<Drive> drive_at(uint64_t tick);

    // How many of the bytes that the base's driver wrote have taken effect at this tick, which never falls.
    uint64_t bytes_at(uint64_t tick);

    static bool ends_block(uint64_t tick);

  private:
    bool take_drive(const std::string &message);
    bool take_base(const std::string &message);

    Answer kind_;
    std::map<uint64_t, Drive> drives_;   // by the tick they take effect
    std::map<uint64_t, uint64_t> bytes_; // likewise: all that the driver had written
    uint64_t blocks_ = 0;                // answered
};

} // namespace bridge_sim
