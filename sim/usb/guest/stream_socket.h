// TCP on this machine's loopback for the server of the simulated device: a listener, a connection that never blocks,
// and one descriptor that wakes for all of them.
#pragma once

#include <cstdint>
#include <optional>

#include "usb_packet.h"

namespace bridge_sim
{

// A file descriptor that closes itself.
class Descriptor
{
  public:
    explicit Descriptor(int number = -1);
    ~Descriptor();
    Descriptor(Descriptor &&other) noexcept;
    Descriptor &operator=(Descriptor &&other) noexcept;
    int get() const;

  private:
    int number_;
};

// Readable when one of the descriptors it watches is ready.
class Waker
{
  public:
    Waker();
    int descriptor() const;

    // Watches for input, and for room to write if `writing`; called again it changes that. A closed descriptor is
    // forgotten by itself.
    void watch(int descriptor, bool writing);

  private:
    Descriptor epoll_;
};

class Listener
{
  public:
    // Listens on 127.0.0.1; port 0 takes a free one. Throws std::runtime_error with one line that names the remedy.
    Listener(uint16_t port, Waker &waker);

    uint16_t port() const;

    // A connection that waits, ready for Stream.
    std::optional<Descriptor> accept();

  private:
    Descriptor socket_;
    uint16_t port_ = 0;
};

class Stream
{
  public:
    Stream(Descriptor socket, Waker &waker);

    // Bytes that have come, at most `most`; 0: none now, or the connection has ended.
    size_t receive(uint8_t *bytes, size_t most);

    // Sends all of it, keeping what does not fit; flush() sends more of that.
    void send_all(const Bytes &bytes);
    void flush();

    bool ended() const;

  private:
    size_t send(const uint8_t *bytes, size_t count);

    Descriptor socket_;
    Waker &waker_;
    Bytes unsent_;
    bool ended_ = false;
    bool writing_ = false;
};

} // namespace bridge_sim
