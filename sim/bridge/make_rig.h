// The rig of a level.
#pragma once

#include <memory>
#include <vector>

#include "rig.h"

namespace bridge_sim
{

// Throws std::runtime_error if there is no memory for the nodes. Lanes 0 .. populated-1 have nodes (node_bus.h).
std::unique_ptr<Rig> make_rig(Level level, size_t populated, uint64_t seed, const std::vector<NodeTrait> &traits = {});

} // namespace bridge_sim
