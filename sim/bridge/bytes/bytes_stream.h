// Level bytes: the bridge's patience. What frame_fifo.v and the bulk endpoint's two buffers do with frames, a packet at
// a time: room for a whole frame or none, what is a packet, where the stream ends.
#pragma once

#include <deque>
#include <optional>

#include "usb_packet.h"

namespace bridge_sim
{

class BytesStream
{
  public:
    // Bus reset or SET_CONFIGURATION: nothing is left.
    void clear();

    // A frame comes. False: no room, it is dropped. One to `keep` ends the stream and waits for room instead; with
    // `ends` any frame ends it.
    bool push(const Bytes &frame, bool keep, bool ends);

    // Has every byte been taken?
    bool drained() const;

    // Is there a frame that waits for room?
    bool waiting() const;

    // The packet that the endpoint has ready, null if it answers NAK; it stays until taken.
    const Bytes *packet() const;
    void packet_taken();

  private:
    void write(const Bytes &frame, bool ends);
    bool room() const;
    void flow();
    void fill();

    struct Packet {
        Bytes data;
        bool ended = false; // with the stream

        bool complete() const;
    };

    std::deque<uint8_t> fifo_;    // bytes, and the one in the output register
    std::deque<uint64_t> ends_;   // of streams, counted in bytes since clear()
    uint64_t moved_ = 0;          // bytes that went on to the endpoint since clear()
    Packet filling_;              // the endpoint's buffer that fills
    std::optional<Packet> ready_; // the other one, to be sent
    std::optional<Bytes> kept_;   // last frame, which waits for room
};

} // namespace bridge_sim
