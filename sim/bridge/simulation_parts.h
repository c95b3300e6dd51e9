// What a simulation is put together of, as its options say. All throw std::runtime_error with one line.
#pragma once

#include <memory>
#include <optional>

#include "device_port.h"
#include "fault_plan.h"
#include "options.h"
#include "rig.h"
extern "C" {
#include "sim_world.h"
}

namespace bridge_sim
{

// Blocks SIGCHLD, SIGINT and SIGTERM in this thread and those it starts; returns the descriptor to read them from.
int block_signals();

sim_scene read_scene(const std::string &path);

std::unique_ptr<Rig> rig_of(const Options &options, const sim_scene &scene);

std::optional<FaultPlan> plan_of(const Options &options, const sim_scene &scene);

// Where the device is shown: to umockdev, or by a server, which says where it listens.
std::unique_ptr<DevicePort> port_of(const Options &options);

} // namespace bridge_sim
