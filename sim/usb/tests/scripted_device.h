// A USB device made of a script, for tests of the host.
#pragma once

#include <deque>
#include <vector>

#include "usb_packet.h"
#include "utmi.h"

namespace bridge_sim
{

// Answers the packets that want an answer (IN tokens and data) with the next packet of the script; an empty one is
// silence. Keeps what it heard.
class ScriptedDevice : public UtmiDevice
{
  public:
    std::deque<Bytes> script;
    uint64_t delay = 0; // cycles before each answer
    std::vector<Bytes> heard;

    void cycle() override
    {
        listen();
        talk();
        cycles++;
    }

  private:
    void listen()
    {
        if (in.rx_valid) {
            incoming_.push_back(in.rx_data);
        }
        if (!in.rx_active && !incoming_.empty()) {
            const uint8_t pid = incoming_[0];
            heard.push_back(incoming_);
            incoming_.clear();
            if ((pid == PID_IN || pid == PID_DATA0 || pid == PID_DATA1) && !script.empty()) {
                outgoing_ = script.front();
                script.pop_front();
                at_ = 0;
                talk_at_ = cycles + delay;
            }
        }
    }

    void talk()
    {
        out.tx_valid = at_ < outgoing_.size() && cycles >= talk_at_;
        if (out.tx_valid) {
            out.tx_data = outgoing_[at_];
            at_ += in.tx_ready;
        }
    }

    Bytes incoming_;
    Bytes outgoing_;
    size_t at_ = 0;
    uint64_t talk_at_ = 0;
};

} // namespace bridge_sim
