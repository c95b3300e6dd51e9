#include "node_bus.h"

#include <algorithm>
#include <stdexcept>

namespace bridge_sim
{

void NodeBus::NodeDeleter::operator()(sim_node *node) const
{
    sim_node_free(node);
}

namespace
{

constexpr uint64_t CUT_NS = SIM_TICK_NS / 2;
constexpr uint64_t CUT_TICKS = 10;

sim_node *make_node(size_t lane, uint64_t seed, const std::vector<NodeTrait> &traits)
{
    auto serial = static_cast<uint32_t>(lane + 1);
    uint16_t chip = WHISKER_LIMIT_CHIP_ID;
    for (const NodeTrait &trait : traits) {
        if (trait.lane == lane && trait.kind == NodeTrait::Kind::SERIAL) {
            serial = static_cast<uint32_t>(trait.value);
        } else if (trait.lane == lane && trait.kind == NodeTrait::Kind::CHIP) {
            chip = static_cast<uint16_t>(trait.value);
        }
    }
    return sim_node_new_named(seed, serial, chip);
}

} // namespace

NodeBus::NodeBus(size_t populated, uint64_t seed, const std::vector<NodeTrait> &traits)
{
    for (const NodeTrait &trait : traits) {
        if (trait.kind == NodeTrait::Kind::CUT) {
            cuts_.push_back({trait.lane, trait.value, 0});
        }
    }
    for (size_t lane = 0; lane < std::min(populated, LANES); lane++) {
        nodes_.emplace_back(make_node(lane, seed * LANES + lane, traits));
        if (!nodes_.back()) {
            throw std::runtime_error("no memory for the nodes");
        }
        sim_node_by_records(nodes_.back().get(), true);
    }
}

void NodeBus::power_on()
{
    for (const auto &node : nodes_) {
        sim_node_power_on(node.get());
    }
}

size_t NodeBus::populated() const
{
    return nodes_.size();
}

void NodeBus::set_fields(const sim_field *fields)
{
    std::copy_n(fields, nodes_.size(), fields_.begin());
}

void NodeBus::spoil_reading(size_t lane, sim_sensor_fault kind, unsigned argument)
{
    sim_node_fault(nodes_.at(lane).get(), kind, argument);
}

void NodeBus::spoil_transfer(size_t lane, LinkFault kind, unsigned bit)
{
    fault_ = kind;
    fault_lane_ = lane;
    fault_bit_ = bit;
}

void NodeBus::cut(uint32_t lanes)
{
    broken_ = lanes;
}

void NodeBus::fail_supplies()
{
    for (SupplyCut &cut : cuts_) {
        sim_node *node = nodes_[cut.lane].get();
        if (cut.ticks == 0 && sim_node_blocks(node) < cut.blocks) {
            continue;
        }
        if (cut.ticks == 0) {
            sim_node_cut(node, CUT_NS);
        } else if (cut.ticks == CUT_TICKS) {
            sim_node_restore(node);
        }
        cut.ticks++;
    }
}

void NodeBus::run()
{
    fail_supplies();
    for (size_t lane = 0; lane < nodes_.size(); lane++) {
        sim_node_run(nodes_[lane].get());
        if (sim_node_differs(nodes_[lane].get())) {
            throw std::runtime_error("lane " + std::to_string(lane) + ": the node's registers make another record");
        }
    }
}

void NodeBus::edges(Levels now, bool mosi)
{
    const Levels before = levels_;
    levels_ = now;
    if (played_) {
        play_edge(now, before);
        return;
    }
    if (now.sync && !before.sync) {
        sync_edge();
    }
    if (now.select_n != before.select_n) {
        select_edge(!now.select_n);
    }
    if (now.sck != before.sck) {
        sck_edge(now.sck, mosi);
    }
}

void NodeBus::sync_edge()
{
    for (size_t lane = 0; lane < nodes_.size(); lane++) {
        sim_node_sync(nodes_[lane].get(), fields_[lane]);
    }
}

void NodeBus::select_edge(bool low)
{
    for (const auto &node : nodes_) {
        sim_node_select(node.get(), low);
    }
    if (low) {
        bits_ = 0;
        sent_.fill(0);
    } else {
        previous_ = sent_;
        fault_ = LinkFault::NONE;
    }
    driven_ = UINT32_MAX;
    miso_ = UINT32_MAX;
}

std::array<uint64_t, LANES> NodeBus::transfer(uint64_t order)
{
    arrived_.fill(UINT64_MAX);
    for (size_t lane = 0; lane < nodes_.size(); lane++) {
        sent_[lane] = sim_node_transfer(nodes_[lane].get(), order);
        arrived_[lane] = broken_ >> lane & 1u ? UINT64_MAX : sent_[lane];
    }
    previous_ = sent_;
    return arrived_;
}

const std::array<uint64_t, LANES> &NodeBus::arrived() const
{
    return arrived_;
}

void NodeBus::play(const std::array<uint64_t, LANES> *records)
{
    played_ = records;
}

void NodeBus::play_edge(Levels now, Levels before)
{
    if (now.select_n != before.select_n) {
        bits_ = 0;
        miso_ = UINT32_MAX;
    }
    if (!now.sck || before.sck) {
        return;
    }
    bits_++;
    for (size_t lane = 0; lane < LANES; lane++) {
        const uint32_t bit = (*played_)[lane] >> (RECORD_BITS - bits_) & 1u;
        miso_ = (miso_ & ~(1u << lane)) | bit << lane;
    }
}

void NodeBus::sck_edge(bool level, bool mosi)
{
    for (size_t lane = 0; lane < nodes_.size(); lane++) {
        const uint32_t bit = sim_node_sck(nodes_[lane].get(), level, mosi) ? 1u : 0u;
        driven_ = (driven_ & ~(1u << lane)) | bit << lane;
        if (level) {
            sent_[lane] = sent_[lane] << 1 | bit;
        }
    }
    bits_ += level ? 1 : 0;
    miso_ = driven_ | broken_;
    if (fault_ != LinkFault::NONE) {
        damage();
    }
}

void NodeBus::damage()
{
    const uint32_t lane = 1u << fault_lane_;
    const unsigned at = bits_ - 1; // the bit that the last rising edge shifted out
    if (bits_ == 0 || at >= RECORD_BITS) {
        return;
    }
    const bool stale_bit = previous_[fault_lane_] >> (RECORD_BITS - 1 - at) & 1u;
    if (fault_ == LinkFault::DEAD || (fault_ == LinkFault::STALE && stale_bit)) {
        miso_ |= lane;
    } else if (fault_ == LinkFault::STALE) {
        miso_ &= ~lane;
    } else if (at == fault_bit_) {
        miso_ ^= lane;
    }
}

} // namespace bridge_sim
