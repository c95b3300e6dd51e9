#include "simulation_parts.h"

#include <csignal>
#include <cstdio>
#include <stdexcept>

#include <sys/signalfd.h>

#include "fault_list.h"
#include "node_list.h"
#include "usbfs_server.h"
#include "usbip_server.h"
#include "usbredir_server.h"

namespace bridge_sim
{

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
template <typename Server> std::unique_ptr<DevicePort> make_server(const char *protocol, uint16_t port)
{
    auto server = std::make_unique<Server>(port);
    std::printf("serving %s at 127.0.0.1:%u\n", protocol, server->port());
    std::fflush(stdout);
    return server;
}

} // namespace

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
    auto rig = make_rig(options.link.level, lanes, options.seed, read_node_list(options.nodes, lanes));
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
        return FaultPlan(std::move(list.lane), std::move(list.usb));
    }
    if (options.faults.empty()) {
        return std::nullopt;
    }
    return FaultPlan(options.seed, populated(options, scene), options.ticks());
}

std::unique_ptr<DevicePort> port_of(const Options &options)
{
    switch (options.serve) {
    case Serve::USBIP:
        return make_server<UsbipServer>("usbip", options.port);
    case Serve::USBREDIR:
        return make_server<UsbredirServer>("usbredir", options.port);
    default:
        return std::make_unique<UsbfsServer>();
    }
}

} // namespace bridge_sim
