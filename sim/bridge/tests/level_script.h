// What a host and the world may do to the bridge, drawn at random: sensible for the most part, else not.
#pragma once

#include <array>
#include <map>
#include <string>
#include <vector>

#include "level_requests.h"

namespace bridge_sim
{

class LevelScript
{
  public:
    LevelScript(LevelPair &pair, size_t populated, uint64_t seed);

    // Some steps and, at the end, every report read. Scripts go on from where the one before ended.
    void run();

    // There are so many kinds of steps, requests within a tick and orders carried out included.
    static constexpr size_t KINDS = 21;

    // How often each kind of step was taken, by its name.
    const std::map<std::string, uint64_t> &taken() const;

  private:
    struct Step {
        const char *name;
        unsigned weight;
        void (LevelScript::*take)();
    };
    static const std::vector<Step> STEPS;

    void step();
    void some_ticks();
    void pause();
    void read_some();
    void drain();
    void start();
    void stop();
    void settings();
    void refused_settings();
    void service();
    void refused_service();
    void flash();
    void read_reports();
    void any_request();
    void halt_endpoint();
    void configure();
    void bus_reset();
    void power_cycle();
    void lane_fault();
    void wire_fault();

    void tick(bool with_request);
    bool takes_tick() const;
    void control(const HostRequest &request);
    HostRequest request_meanwhile();
    void draw_fields();
    void forget_run();

    LevelPair &pair_;
    size_t populated_;
    RequestSource draw_;
    std::array<sim_field, LANES> fields_{};
    std::map<std::string, uint64_t> taken_;
    bool run_ = false; // as last written
    bool ticked_ = false;
    bool stop_asked_ = false;
    bool last_made_ = false;
};

} // namespace bridge_sim
