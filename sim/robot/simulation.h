// The whole simulated robot as a USB device beside a running command, or served by USB/IP: decides when a
// tick may be produced, produces it, and serves USB and the socket in between. Simulated time leads; the machine's
// speed changes nothing that is recorded.
#pragma once

#include <array>
#include <memory>

#include "child.h"
#include "create_base.h"
#include "defect.h"
#include "device_port.h"
#include "follower_server.h"
#include "logs.h"
#include "options.h"
#include "pace.h"
#include "speed_report.h"

namespace bridge_sim
{

class Simulation
{
  public:
    // Reads the scene, builds the world, enumerates the bridge and shows it to umockdev, or serves it. Blocks SIGCHLD,
    // SIGINT and SIGTERM for good: they are read in run(). Throws std::runtime_error with one line.
    explicit Simulation(const Options &options);
    ~Simulation();
    Simulation(const Simulation &) = delete;
    Simulation &operator=(const Simulation &) = delete;

    // The run, from the command's start to its end. Returns its exit code, or 1 if it ended too soon. A device that is
    // served has no command: the run ends with its time, or, as well, by a signal.
    int run();

  private:
    struct WorldDeleter {
        void operator()(sim_world *world) const;
    };

    bool ended() const;
    bool advance();
    bool bridge_ticks() const;
    bool wall_leads() const;
    bool host_allows();
    bool may_tick();
    bool may_pass();
    void produce_tick();
    void pass_tick();
    void step_world();
    void after_tick(uint64_t tick);
    void produce_last_tick();
    void end_run();
    void close_run();
    void show_progress();
    void finish();
    int verdict() const;

    // Surroundings: what is heard from outside.
    void obey_cable();
    void obey_lane_changes();
    void plug();
    void unplug();
    void take_requests();
    bool deliver_completed(); // true: something was delivered
    void wait(int timeout_ms);
    void read_signals();

    const Options &options_;
    sim_scene scene_;
    std::unique_ptr<sim_world, WorldDeleter> world_;
    int signals_;
    std::unique_ptr<Rig> rig_;
    UrbScheduler scheduler_;
    FaultLog faults_;
    TickRunner runner_;
    TruthLog truth_;
    WheelLog wheels_;
    std::unique_ptr<CreateBase> create_; // none: the pilot drives the world's base itself
    FollowerServer followers_;           // after it: who connects finds the port
    Defect defect_;
    Pace pace_;
    Patience patience_;
    bool host_late_ = false; // the tick that is due waits for it
    bool host_away_ = false; // it will not come by itself
    std::unique_ptr<DevicePort> port_;
    std::unique_ptr<Child> child_;
    std::array<sim_field, LANES> fields_{};
    uint64_t total_;
    uint64_t tick_ = 0;  // produced so far
    unsigned steps_ = 0; // taken, of whatever was due
    bool plugged_ = false;
    bool over_ = false;      // no more ticks; the command has been asked to end
    bool stopped_ = false;   // by a signal
    double killed_at_s_ = 0; // when the command will have had time enough to end
    Speed speed_;
    double first_tick_s_ = 0;
    uint64_t first_tick_cycles_ = 0;
};

} // namespace bridge_sim
