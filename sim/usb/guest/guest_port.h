// The device for guests that come over TCP: what the servers of USB/IP and usbredir have alike.
#pragma once

#include "guest_transfers.h"
#include "stream_socket.h"

namespace bridge_sim
{

// A client that breaks the protocol loses its connection, and one line on standard error says why.
class GuestPort : public DevicePort
{
  public:
    uint16_t port() const
    {
        return listener_.port();
    }

    int wake_descriptor() const override
    {
        return waker_.descriptor();
    }

  protected:
    // Listens on 127.0.0.1; port 0 takes a free one. Throws std::runtime_error with one line.
    explicit GuestPort(uint16_t port) : listener_(port, waker_)
    {
    }

    Waker waker_;
    Listener listener_;
    GuestTransfers transfers_;
};

} // namespace bridge_sim
