#include "simulation.h"

#include <chrono>
#include <cinttypes>
#include <csignal>
#include <cstdio>
#include <memory>
#include <optional>
#include <stdexcept>

#include <poll.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include "device_port.h"
#include "fault_list.h"
#include "fault_plan.h"
#include "make_rig.h"
#include "node_list.h"
#include "options.h"
#include "rig.h"
#include "usbfs_server.h"
#include "usbip_server.h"
extern "C" {
#include "sim_world.h"
}

namespace bridge_sim
{

// ---- what a simulation is put together of, as its options say

namespace
{

size_t populated(const Options &options, const sim_scene &scene)
{
    if (options.lanes_populated == 0) {
        return scene.whiskers;
    }
    if (options.lanes_populated < scene.whiskers) {
        throw std::runtime_error("--lanes-populated " + std::to_string(options.lanes_populated) + ": the scene has " +
                                 std::to_string(scene.whiskers) + " whiskers; give at least as many");
    }
    return options.lanes_populated;
}

// A server says where it listens, for port 0 takes a free one.
std::unique_ptr<DevicePort> make_server(uint16_t port)
{
    auto server = std::make_unique<UsbipServer>(port);
    std::printf("serving usbip at 127.0.0.1:%u\n", server->port());
    std::fflush(stdout);
    return server;
}

// In all threads, so before umockdev starts its own.
int block_signals()
{
    sigset_t set;
    sigemptyset(&set);
    sigaddset(&set, SIGCHLD);
    sigaddset(&set, SIGINT);
    sigaddset(&set, SIGTERM);
    sigprocmask(SIG_BLOCK, &set, nullptr);
    signal(SIGPIPE, SIG_IGN);
    return signalfd(-1, &set, SFD_NONBLOCK | SFD_CLOEXEC);
}

sim_scene read_scene(const std::string &path)
{
    sim_scene scene;
    char error[512] = "";
    if (sim_scene_read(path.c_str(), &scene, error, sizeof error) != 0) {
        throw std::runtime_error(error);
    }
    return scene;
}

std::unique_ptr<Rig> rig_of(const Options &options, const sim_scene &scene)
{
    const size_t lanes = populated(options, scene);
    auto rig =
        make_rig(options.link.level, lanes, options.seed, read_node_list(options.nodes, lanes), options.link.rtl_ticks);
    if (!options.flash.empty()) {
        rig->flash().keep_in(options.flash);
    }
    rig->flash().cut_after(options.flash_cut);
    return rig;
}

std::optional<FaultPlan> plan_of(const Options &options, const sim_scene &scene)
{
    if (!options.fault_list.empty()) {
        FaultList list = read_fault_list(options.fault_list, populated(options, scene));
        return FaultPlan(std::move(list.lane), std::move(list.usb), std::move(list.lasting));
    }
    if (options.faults.empty()) {
        return std::nullopt;
    }
    return FaultPlan(options.seed, populated(options, scene), options.ticks());
}

std::unique_ptr<DevicePort> port_of(const Options &options)
{
    return options.usbip ? make_server(options.port) : std::make_unique<UsbfsServer>();
}

} // namespace

// ---- the run

namespace
{

constexpr uint64_t PROGRESS_TICKS = WHISKER_LIMIT_CLOCK_HZ / WHISKER_LIMIT_TICK_PERIOD;
constexpr int IDLE_WAIT_MS = 1000;
constexpr int HOST_WAIT_MS = 50; // for its next transfer, which wakes: to look after it as often as Patience does
// While there is something to do: to look who has come costs as much as a tick in the model of bytes.
constexpr unsigned STEPS_TO_LOOK = 8;
// A command that has not ended so long after SIGTERM is killed.
constexpr double END_PATIENCE_S = 30;

double now_s()
{
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

// Does the base's driver go by the wall's clock? With a pilot in step it goes by the base's frames.
bool clocked(const Options &options)
{
    return options.pace > 0 && options.followers == 0;
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
      create_(options.create.on ? std::make_unique<CreateBase>(options.create, options.seed, clocked(options))
                                : nullptr),
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
    if (!options_.usbip) {
        child_ = std::make_unique<Child>(options_.command);
    }
    while (!ended()) {
        const bool stepped = advance();
        const bool progress = deliver_completed() || stepped; // a delivery takes requests, which must not wait
        if (!progress) {
            wait(host_late_ ? HOST_WAIT_MS : pace_.wait_ms(tick_, IDLE_WAIT_MS));
        } else if (++steps_ % STEPS_TO_LOOK == 0) {
            wait(0);
        }
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
// the next one stops it. One that a busy machine lets wait is waited for.
bool Simulation::host_allows()
{
    host_late_ = !runner_.ready();
    if (patience_.over(!host_late_)) {
        host_away_ = !port_->host_lives();
    }
    host_away_ = host_away_ && host_late_;
    return !host_late_ || (host_away_ && wall_leads());
}

bool Simulation::may_tick()
{
    host_late_ = false;
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
    speed_.rtl_ticks.resize(tick_ / PROGRESS_TICKS + 1);
    speed_.rtl_ticks.back() += rig_->at_rtl() ? 1 : 0;
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
        followers_.send_truth(tick, sim_scene_on_map(&scene_, sim_world_pose(world_.get())));
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
    speed_ = {tick_, rig_->cycles() - first_tick_cycles_, now_s() - first_tick_s_, rig_->bus().populated(),
              std::move(speed_.rtl_ticks)};
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

// ---- what comes from outside: the cable, the lanes, USB requests, signals

void Simulation::obey_cable()
{
    while (const std::optional<Cable> asked = followers_.take_cable()) {
        if ((*asked == Cable::PLUG) == plugged_) {
            throw std::runtime_error(plugged_ ? "socket: 'plug', but the bridge is plugged in"
                                              : "socket: 'unplug', but the bridge is not plugged in");
        }
        plugged_ ? unplug() : plug();
    }
}

void Simulation::obey_lane_changes()
{
    while (const std::optional<LaneChange> change = followers_.take_lane_change()) {
        if (change->lane >= rig_->bus().populated()) {
            throw std::runtime_error("socket: lane " + std::to_string(change->lane) + " has no node");
        }
        runner_.set_dead(change->lane, change->dead);
    }
}

void Simulation::plug()
{
    Descriptors descriptors;
    const char *error = nullptr;
    if (!rig_->power_cycle(descriptors, error)) {
        throw std::runtime_error(std::string("the bridge does not enumerate: ") + error);
    }
    scheduler_.plug(true);
    port_->plug(descriptors);
    plugged_ = true;
}

// What is under way ends first, so that its results are handed over before the device is gone. The world stands still
// until ticks are produced again.
void Simulation::unplug()
{
    take_requests();
    scheduler_.plug(false);
    runner_.unplugged();
    rig_->forget_frames();
    deliver_completed();
    port_->unplug();
    take_requests(); // those handed in meanwhile end as well
    plugged_ = false;
}

void Simulation::take_requests()
{
    for (DeviceRequest &request : port_->take_requests()) {
        if (request.discard) {
            scheduler_.discard(request.urb.id);
        } else {
            scheduler_.submit(std::move(request.urb));
        }
    }
}

bool Simulation::deliver_completed()
{
    std::vector<Urb> urbs = scheduler_.take_completed();
    if (urbs.empty()) {
        return false;
    }
    defect_.spoil(urbs);
    port_->deliver(std::move(urbs));
    take_requests();
    return true;
}

void Simulation::wait(int timeout_ms)
{
    std::vector<pollfd> descriptors = {{signals_, POLLIN, 0}, {port_->wake_descriptor(), POLLIN, 0}};
    followers_.add_to(descriptors);
    if (create_) {
        create_->add_to(descriptors);
    }
    if (poll(descriptors.data(), descriptors.size(), timeout_ms) <= 0) {
        return;
    }
    if (descriptors[0].revents) {
        read_signals();
    }
    if (descriptors[1].revents) {
        take_requests();
    }
    if (create_) {
        create_->receive();
    }
    followers_.receive();
    obey_cable();
    obey_lane_changes();
}

void Simulation::read_signals()
{
    signalfd_siginfo signal_info;
    while (read(signals_, &signal_info, sizeof signal_info) == sizeof signal_info) {
        if (signal_info.ssi_signo != SIGCHLD) {
            stopped_ = true;
            end_run();
        }
    }
}

} // namespace bridge_sim
