// The wires between the bridge and its nodes: turns pin levels into calls of the node models, and can damage a
// transfer on its way. Lanes without a node read as ones.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "node_list.h"
#include "whisker_protocol.h"
extern "C" {
#include "sim_node.h"
}

namespace bridge_sim
{

constexpr size_t LANES = WHISKER_LIMIT_LANES;
constexpr unsigned RECORD_BITS = 8 * WHISKER_RECORD_BYTES;

// What the wire of one lane does to one transfer.
enum class LinkFault {
    NONE,
    FLIP, // one bit arrives inverted
    DEAD, // the line reads ones
    STALE // the lane repeats the bits of the transfer before
};

class NodeBus
{
  public:
    // Nodes on lanes 0 .. populated-1 (at most LANES), each seeded from `seed` and its lane, with serial numbers from 1
    // on but for the traits.
    NodeBus(size_t populated, uint64_t seed, const std::vector<NodeTrait> &traits = {});

    // Lets every node's start-up time pass.
    void power_on();

    size_t populated() const;

    // Fields of the readings that the next SYNC starts; one entry per populated lane.
    void set_fields(const sim_field *fields);

    // Spoils the reading that the next SYNC starts.
    void spoil_reading(size_t lane, sim_sensor_fault kind, unsigned argument);

    // Spoils the next transfer of one lane; `bit` counts from the first bit on the wire and is used by FLIP only.
    void spoil_transfer(size_t lane, LinkFault kind, unsigned bit);

    // The cables of these lanes, a bit each, are broken: the bridge reads ones. All others are whole.
    void cut(uint32_t lanes);

    // Levels of the bridge's outputs now; returns the MISO levels, bit n for lane n. Called every clock cycle.
    uint32_t pins(bool sync, bool select_n, bool sck, bool mosi)
    {
        const Levels now{sync, select_n, sck};
        if (now.sync != levels_.sync || now.select_n != levels_.select_n || now.sck != levels_.sck) {
            edges(now, mosi);
        }
        return miso_;
    }

    // The edges of a whole transfer at once: select, the bits of this order, first one highest, and select again.
    // Returns what arrives of each lane, likewise; the wires damage nothing of it.
    std::array<uint64_t, LANES> transfer(uint64_t order);

    // What that transfer brought.
    const std::array<uint64_t, LANES> &arrived() const;

    // The next transfers bring these bits, likewise, and the nodes hear nothing of them; null: the nodes answer again.
    void play(const std::array<uint64_t, LANES> *records);

    // The rest of the tick, in the nodes' own virtual time: they read their sensors. Throws std::runtime_error if a
    // node that was run at record level differs from its registers.
    void run();

  private:
    struct Levels {
        bool sync;
        bool select_n;
        bool sck;
    };
    struct SupplyCut {
        size_t lane;
        uint64_t blocks; // of an update, after which it happens
        uint64_t ticks;  // since then
    };
    struct NodeDeleter {
        void operator()(sim_node *node) const;
    };

    void edges(Levels now, bool mosi);
    void play_edge(Levels now, Levels before);
    void sync_edge();
    void select_edge(bool low);
    void sck_edge(bool level, bool mosi);
    void damage();
    void fail_supplies();

    std::vector<std::unique_ptr<sim_node, NodeDeleter>> nodes_;
    std::array<sim_field, LANES> fields_{};
    std::array<uint64_t, LANES> sent_{};     // bits of this transfer so far, first bit highest
    std::array<uint64_t, LANES> previous_{}; // bits of the transfer before
    std::array<uint64_t, LANES> arrived_{};
    const std::array<uint64_t, LANES> *played_ = nullptr;
    std::vector<SupplyCut> cuts_;
    unsigned bits_ = 0; // rising SCK edges since select went low
    Levels levels_{false, true, false};
    uint32_t driven_ = UINT32_MAX; // what the nodes drive
    uint32_t miso_ = UINT32_MAX;   // what arrives
    uint32_t broken_ = 0;          // lanes, a bit each
    LinkFault fault_ = LinkFault::NONE;
    size_t fault_lane_ = 0;
    unsigned fault_bit_ = 0;
};

} // namespace bridge_sim
