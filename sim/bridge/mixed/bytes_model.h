// The model of bytes: the bridge while nothing but plain sampling goes on, without a clock. A tick's records are taken
// whole, and its frame is there at once, in the packets that the bulk endpoint would make of it.
#pragma once

#include <deque>

#include "node_bus.h"
#include "sampling_state.h"
#include "usb_packet.h"

namespace bridge_sim
{

class BytesModel
{
  public:
    // The bus must outlive the model.
    explicit BytesModel(NodeBus &bus);

    // Goes on with a run whose frames so far have all been taken; and how far it has come.
    void go_on(const SamplingSettings &settings, const SamplingState &state);
    const SamplingState &sampling() const;

    // A tick, with the frame made of its records, and the start-of-frame packets that come with it: so many (at least
    // one) from the host's `microframe` on.
    void tick(uint64_t microframe, unsigned microframes);

    uint32_t tick_period() const; // cycles
    bool drained() const;         // all frames have been taken

    // The packet that the endpoint has ready (null: none), and its acknowledgement.
    const Bytes *packet() const;
    void packet_taken();

  private:
    void start_of_frame(uint64_t microframe);
    Bytes header() const;
    void send(const Bytes &frame);

    NodeBus &bus_;
    SamplingSettings settings_{};
    SamplingState state_{};
    Bytes filling_;             // less than a packet
    std::deque<Bytes> packets_; // ready
};

} // namespace bridge_sim
