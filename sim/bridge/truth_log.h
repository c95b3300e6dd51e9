// What really happened, for judging the estimates: pose and texture tips at the end of every 0.1 s.
#pragma once

#include <vector>

#include "fault_log.h"
extern "C" {
#include "sim_world.h"
}

namespace bridge_sim
{

constexpr uint64_t TRUTH_TICKS = 200; // 0.1 s: a row, and a report of odometry

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

} // namespace bridge_sim
