#include "simulation.h"

#include <chrono>
#include <cinttypes>
#include <stdexcept>

#include <unistd.h>

#include "simulation_parts.h"

namespace bridge_sim
{

namespace
{

constexpr uint64_t PROGRESS_TICKS = WHISKER_LIMIT_CLOCK_HZ / WHISKER_LIMIT_TICK_PERIOD;
constexpr int IDLE_WAIT_MS = 1000;
// A command that has not ended so long after SIGTERM is killed.
constexpr double END_PATIENCE_S = 30;

double now_s()
{
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

} // namespace

void Simulation::WorldDeleter::operator()(sim_world *world) const
{
    sim_world_free(world);
}

Simulation::Simulation(const Options &options)
    : options_(options), scene_(read_scene(options.scene)), world_(sim_world_new(&scene_, options.seed)),
      signals_(block_signals()), rig_(rig_of(options, scene_)), scheduler_(*rig_),
      faults_(options.faults, options.usb_faults), runner_(*rig_, scheduler_, plan_of(options, scene_), faults_),
      truth_(options.truth, scene_), wheels_(options.wheels),
      create_(options.create.on ? std::make_unique<CreateBase>(options.create, options.seed) : nullptr),
      followers_(options.socket, options.followers, options.create.on ? Answer::BASE : Answer::DRIVE),
      defect_(options.defect), pace_(options.pace), total_(options.ticks())
{
    if (!world_) {
        throw std::runtime_error(options.scene + ": no world can be made of it: a texture has no known parameters");
    }
    port_ = port_of(options);
    scheduler_.plug(false);
    if (!options.unplugged) {
        plug();
    }
}

Simulation::~Simulation()
{
    child_.reset();
    port_.reset();
    close(signals_);
}

int Simulation::run()
{
    if (options_.serve == Serve::COMMAND) {
        child_ = std::make_unique<Child>(options_.command);
    }
    while (!ended()) {
        const bool progress = advance();
        deliver_completed();
        wait(progress ? 0 : pace_.wait_ms(tick_, IDLE_WAIT_MS));
    }
    finish();
    return verdict();
}

bool Simulation::ended() const
{
    return child_ ? child_->ended() : over_;
}

// One step of whatever is due; false: all is waiting for others.
bool Simulation::advance()
{
    if (over_ && child_ && now_s() > killed_at_s_) {
        child_->kill();
        throw std::runtime_error("the command did not end when asked to: killed");
    }
    if (plugged_ && rig_->running() && scheduler_.stop_seen() && runner_.may_end()) {
        produce_last_tick();
        return true;
    }
    if (may_tick()) {
        produce_tick();
        return true;
    }
    if (may_pass()) {
        pass_tick();
        return true;
    }
    return scheduler_.step();
}

// ----------------------------------------------------------------------------------------------------------------
// ticks

bool Simulation::bridge_ticks() const
{
    return plugged_ && rig_->running() && !scheduler_.stop_seen();
}

// Wall time goes on while nobody takes frames: so does the world, unless a pilot counts its ticks.
bool Simulation::wall_leads() const
{
    return pace_.on() && !followers_.in_step();
}

// The bridge of a host that was stopped or killed ticks on: its FIFO overflows, until the host takes frames again or
// the next one stops it.
bool Simulation::host_allows()
{
    const bool ready = runner_.ready();
    const bool away = patience_.over(ready);
    return ready || (away && wall_leads() && port_->host_in_real_time());
}

bool Simulation::may_tick()
{
    return bridge_ticks() && !over_ && followers_.allows(tick_) &&
           (!create_ || create_->has(followers_.bytes_at(tick_))) && pace_.due(tick_) && host_allows();
}

bool Simulation::may_pass()
{
    return wall_leads() && tick_ > 0 && !over_ && !bridge_ticks() && pace_.due(tick_);
}

void Simulation::produce_tick()
{
    if (tick_ == 0) {
        first_tick_s_ = now_s();
        first_tick_cycles_ = rig_->cycles();
    }
    step_world();
    runner_.tick(tick_, fields_.data());
    after_tick(tick_++);
    if (tick_ == total_) {
        end_run();
    }
}

// A tick of the world of which the bridge, stopped or unplugged, makes no frame.
void Simulation::pass_tick()
{
    step_world();
    after_tick(tick_++);
    if (tick_ == total_) {
        end_run();
    }
}

void Simulation::step_world()
{
    if (create_) {
        create_->drive(world_.get(), followers_.bytes_at(tick_));
        wheels_.note(tick_, create_->speed());
    } else if (const std::optional<Drive> drive = followers_.drive_at(tick_)) {
        sim_world_drive(world_.get(), drive->v_m_s, drive->omega_rad_s);
    }
    sim_world_step(world_.get());
    sim_world_fields(world_.get(), fields_.data());
    if (create_) {
        create_->tick(world_.get());
    }
}

void Simulation::after_tick(uint64_t tick)
{
    if (create_) {
        followers_.send_base(tick, create_->sent());
    }
    if ((tick + 1) % TRUTH_TICKS == 0) {
        double x_m = 0;
        double y_m = 0;
        double theta_rad = 0;
        truth_.row(tick, world_.get());
        followers_.send_truth(tick, sim_world_pose(world_.get()));
        sim_world_odometry(world_.get(), &x_m, &y_m, &theta_rad);
        if (!create_) {
            followers_.send_odometry(tick, x_m, y_m, theta_rad);
        }
    }
    if ((tick + 1) % PROGRESS_TICKS == 0) {
        show_progress();
    }
}

// The host stopped the bridge: because the run is over, or of its own accord; then it may start it again.
void Simulation::produce_last_tick()
{
    runner_.last_tick(fields_.data());
}

void Simulation::end_run()
{
    if (!over_) {
        close_run();
        killed_at_s_ = now_s() + END_PATIENCE_S;
        if (child_) {
            child_->ask_to_end();
        }
    }
}

void Simulation::close_run()
{
    over_ = true;
    speed_ = {tick_, rig_->cycles() - first_tick_cycles_, now_s() - first_tick_s_, rig_->bus().populated()};
    followers_.send_end(tick_);
}

void Simulation::show_progress()
{
    if (options_.progress || isatty(STDERR_FILENO)) {
        std::fprintf(stderr, "progress %" PRIu64 " %" PRIu64 "\n", tick_, total_);
    }
}

void Simulation::finish()
{
    if (!over_) { // the command ended of its own accord
        close_run();
    }
    truth_.close();
    wheels_.close();
    faults_.close();
    write_speed_report(options_.speed_report, speed_, faults_);
}

int Simulation::verdict() const
{
    if (child_ && child_->exit_code() != 0) {
        return child_->exit_code();
    }
    if (child_ && (stopped_ || tick_ < total_)) {
        throw std::runtime_error("the run ended after " + std::to_string(tick_) + " of " + std::to_string(total_) +
                                 " ticks");
    }
    runner_.check_usb();
    return 0;
}

} // namespace bridge_sim
