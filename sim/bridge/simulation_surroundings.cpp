// What a simulation hears from outside, and does about it: the cable, the lanes, USB requests, signals.
#include "simulation.h"

#include <csignal>
#include <stdexcept>

#include <poll.h>
#include <sys/signalfd.h>
#include <unistd.h>

namespace bridge_sim
{

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

void Simulation::deliver_completed()
{
    std::vector<Urb> urbs = scheduler_.take_completed();
    if (urbs.empty()) {
        return;
    }
    defect_.spoil(urbs);
    port_->deliver(std::move(urbs));
    take_requests();
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
