// Nodes that are not all alike: serial numbers, another chip, a supply that fails, given one by one in a file.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace bridge_sim
{

struct NodeTrait {
    enum class Kind { SERIAL, CHIP, CUT };
    size_t lane;
    Kind kind;
    uint64_t value; // serial number, device id, or the blocks of an update after which the supply fails once
};

// A line per trait: "LANE serial N", "LANE chip ID" or "LANE cut BLOCK" (of the first update). An empty path:
// none. Throws std::runtime_error: file, line, what, remedy.
std::vector<NodeTrait> read_node_list(const std::string &path, size_t lanes);

} // namespace bridge_sim
