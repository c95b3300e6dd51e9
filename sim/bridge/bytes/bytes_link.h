// Level bytes: the nodes' bus, a window at a time. The edges come in the order in which node_link.v makes them; what a
// node does with them is its own firmware's affair, in its own virtual time.
#pragma once

#include <array>

#include "node_bus.h"
#include "usb_packet.h"

namespace bridge_sim
{

using Record = std::array<uint8_t, WHISKER_RECORD_BYTES>;
using Records = std::array<Record, LANES>;

// SYNC: readings start.
void link_sync(NodeBus &bus);

// A window: `order` goes out, and what comes back meanwhile are the lanes' records and whatever follows them.
Records link_window(NodeBus &bus, const Bytes &order);

// The order of a tick's first window, without and with a second one to come.
Bytes sample_order(uint8_t tick, bool service);

// The second window, from a service report that was accepted.
Bytes service_order(uint8_t tick, const Bytes &report);

// What lane_receiver.v says of a record that should be of this tick: WHISKER_CODE_OK or why it was not accepted.
uint8_t link_verdict(const Record &record, uint8_t expected_tick);

// What the bridge's own pattern puts in place of the records (pattern_source.v).
Records pattern_records(uint8_t tick);

// What stands in place of a record that was not accepted (framer.v).
Record error_record(uint8_t tick, uint8_t code);

} // namespace bridge_sim
