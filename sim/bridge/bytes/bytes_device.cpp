#include "bytes_device.h"

namespace bridge_sim
{

namespace
{

constexpr uint8_t ENDPOINT_NUMBER = 0x0F; // of an endpoint's address
constexpr int ATTEMPTS = 3;               // of a host controller

} // namespace

BytesDevice::BytesDevice(BytesBridge &bridge) : bridge_(bridge)
{
}

void BytesDevice::power_up()
{
    bridge_.power_up();
    bus_reset();
}

// It is seen only after 3 ms: a tick that has begun is over by then.
void BytesDevice::bus_reset()
{
    bridge_.end_tick();
    address_ = configuration_ = idle_ = 0;
    restart();
}

void BytesDevice::restart()
{
    bridge_.halt();
    halted_.fill(false);
    ack_lost_ = false;
}

void BytesDevice::arm(WireFault fault)
{
    armed_ = fault;
}

const HostCounters &BytesDevice::counters() const
{
    return counters_;
}

bool BytesDevice::use(WireFault fault)
{
    if (armed_ != fault) {
        return false;
    }
    armed_ = WireFault::NONE;
    counters_.injected++;
    return true;
}

// --------------------------------------------------------------------------------------------------------- endpoint 0

Outcome BytesDevice::control(const SetupRequest &request, Bytes &data)
{
    use(WireFault::BAD_SETUP);
    if (request.to_host() && request.length != 0) {
        data.clear();
    }
    const Outcome outcome = serve(request, data);
    counters_.stalls += outcome == Outcome::STALL ? 1 : 0;
    if (outcome == Outcome::OK || request.to_host() || request.length == 0) {
        use(WireFault::BAD_TOKEN); // there was an IN token
    }
    if (outcome == Outcome::OK) { // and data after it
        counters_.crc_errors += use(WireFault::BAD_DATA) ? 1 : 0;
        use(WireFault::LOST_ACK);
    }
    return outcome;
}

// ---------------------------------------------------------------------------------------------------- other endpoints

Outcome BytesDevice::in(uint8_t endpoint, Bytes &data)
{
    counters_.transactions++;
    use(WireFault::BAD_TOKEN);
    const size_t which = endpoint == (ADDRESS_OF[BULK] & ENDPOINT_NUMBER) ? BULK : HID;
    if (configuration_ == 0) {
        counters_.timeouts += ATTEMPTS;
        counters_.unexplained += ATTEMPTS;
        return Outcome::TIMEOUT;
    }
    if (halted_[which]) {
        counters_.stalls++;
        return Outcome::STALL;
    }
    const Outcome outcome = which == BULK ? bulk_in(data) : Outcome::NAK;
    counters_.naks += outcome == Outcome::NAK ? 1 : 0;
    return outcome;
}

Outcome BytesDevice::bulk_in(Bytes &data)
{
    if (ack_lost_) { // the copy, which the host drops
        counters_.duplicates += use(WireFault::LOST_ACK) ? 2 : 1;
        ack_lost_ = false;
        bridge_.packet_taken();
    }
    if (!bridge_.packet()) {
        return Outcome::NAK;
    }
    counters_.crc_errors += use(WireFault::BAD_DATA) ? 1 : 0;
    data = *bridge_.packet();
    ack_lost_ = use(WireFault::LOST_ACK);
    if (!ack_lost_) {
        bridge_.packet_taken();
    }
    return Outcome::OK;
}

} // namespace bridge_sim
