#include "node_list.h"

#include <fstream>
#include <sstream>
#include <stdexcept>

namespace bridge_sim
{

namespace
{

bool parse(const std::string &line, NodeTrait &trait)
{
    std::istringstream words(line);
    std::string kind;
    std::string value;
    std::string rest;
    if (!(words >> trait.lane >> kind >> value) || words >> rest) {
        return false;
    }
    if (kind == "serial") {
        trait.kind = NodeTrait::Kind::SERIAL;
    } else if (kind == "chip") {
        trait.kind = NodeTrait::Kind::CHIP;
    } else if (kind == "cut") {
        trait.kind = NodeTrait::Kind::CUT;
    } else {
        return false;
    }
    size_t used = 0;
    trait.value = std::stoull(value, &used, 0);
    return used == value.size();
}

} // namespace

std::vector<NodeTrait> read_node_list(const std::string &path, size_t lanes)
{
    std::vector<NodeTrait> traits;
    if (path.empty()) {
        return traits;
    }
    std::ifstream file(path);
    if (!file) {
        throw std::runtime_error(path + ": cannot be read; check the name");
    }
    std::string line;
    for (int number = 1; std::getline(file, line); number++) {
        NodeTrait trait{};
        bool good = false;
        try {
            good = parse(line, trait) && trait.lane < lanes;
        } catch (const std::logic_error &) {
            good = false;
        }
        if (!good) {
            throw std::runtime_error(
                path + ":" + std::to_string(number) +
                ": give 'LANE serial N', 'LANE chip ID' or 'LANE cut BLOCK', with a populated lane");
        }
        traits.push_back(trait);
    }
    return traits;
}

} // namespace bridge_sim
