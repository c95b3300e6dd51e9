// What really happened, in CSV files: the true poses, and the orders to the wheels.
#pragma once

#include <vector>

#include "fault_log.h"
#include "pilot_answers.h"
extern "C" {
#include "sim_world.h"
}

namespace bridge_sim
{

constexpr uint64_t TRUTH_TICKS = 200; // 0.1 s: a row, and a report of odometry

// For judging estimates: pose and texture tips at the end of every 0.1 s.
class TruthLog
{
  public:
    // Columns: tick,x_m,y_m,theta_rad and for each texture whisker NAME_tile,NAME_inside_mm,NAME_moved_mm.
    TruthLog(const std::string &path, const sim_scene &scene);

    // The state at the end of this tick; `moved` counts since the row before.
    void row(uint64_t tick, const sim_world *world);
    void close();

  private:
    std::string header() const;
    std::string tip(size_t lane, const sim_tip &tip);

    const sim_scene &scene_;
    std::vector<double> travelled_m_; // by lane, at the row before
    CsvFile file_;
};

// What the wheels of the base were ordered, and when: for judging how soon they stop.
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
