// Keeps simulated time to the wall's: no tick before its time. A machine too slow, or a host that stood still, moves
// the times of all later ticks: nothing is hurried to catch up.
#pragma once

#include <cstdint>
#include <optional>

namespace bridge_sim
{

class Pace
{
  public:
    // Simulated seconds per second of wall time; 0: no tick has to wait.
    explicit Pace(double factor);

    bool on() const;

    // May the tick of this number be produced? The first one asked for sets the time of all others.
    bool due(uint64_t tick);

    // At most so many milliseconds may be slept before asking again for this tick.
    int wait_ms(uint64_t tick, int most_ms) const;

  private:
    double late_s(uint64_t tick) const;

    double factor_;
    std::optional<double> origin_s_; // wall time of tick 0, once it is known
};

// When a paced world looks after a host that takes no frames.
class Patience
{
  public:
    // The host takes frames, or does not: has it not for so long that it is time to look, once more?
    bool over(bool takes);

  private:
    std::optional<double> since_; // wall time; it takes none
};

} // namespace bridge_sim
