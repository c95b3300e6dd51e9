// The rig of a level.
#pragma once

#include <memory>
#include <vector>

#include "rig.h"

namespace bridge_sim
{

// Throws std::runtime_error if there is no memory for the nodes. Lanes 0 .. populated-1 have nodes (node_bus.h). At
// level mixed the first `rtl_ticks` ticks are RTL's.
std::unique_ptr<Rig> make_rig(Level level, size_t populated, uint64_t seed, const std::vector<NodeTrait> &traits = {},
                              uint64_t rtl_ticks = 0);

} // namespace bridge_sim
