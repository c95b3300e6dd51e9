// What the wheels of the base were ordered, and when: for judging how soon they stop.
#pragma once

#include "fault_log.h"
#include "pilot_answers.h"

namespace bridge_sim
{

class WheelLog
{
  public:
    // Columns: tick,monotonic_s,v_m_s,omega_rad_s. An empty path: nothing is written.
    explicit WheelLog(const std::string &path);

    // The speeds in force at this tick: a row if they are others than before, stamped with the monotonic clock.
    void note(uint64_t tick, const Drive &drive);
    void close();

  private:
    CsvFile file_;
    Drive last_{};
};

} // namespace bridge_sim
