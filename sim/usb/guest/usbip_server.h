// Serves the device over USB/IP, as `usbip attach` of a Linux machine wants it. One client has the device at a time;
// others may ask what there is. A client that breaks the protocol loses its connection, and one line on standard error
// says why.
#pragma once

#include <list>
#include <memory>

#include "guest_transfers.h"
#include "stream_socket.h"
#include "usbip_codec.h"

namespace bridge_sim
{

class UsbipServer : public DevicePort
{
  public:
    // Listens on 127.0.0.1; port 0 takes a free one. Throws std::runtime_error with one line.
    explicit UsbipServer(uint16_t port);
    ~UsbipServer() override;

    uint16_t port() const;

    void plug(const Descriptors &descriptors) override;
    void unplug() override;
    int wake_descriptor() const override;
    std::vector<DeviceRequest> take_requests() override;
    void deliver(std::vector<Urb> completed) override;

  private:
    struct Connection;

    void accept_all();
    bool serve(Connection &connection);
    void handle(Connection &connection, UsbipMessage message);
    void import(Connection &connection, const std::string &bus_id);
    void submit(Connection &connection, UsbipMessage message);
    void unlink(Connection &connection, const UsbipMessage &message);
    void imported(int status);
    void answer(uint32_t sequence, const Urb &urb);
    void detach();

    Waker waker_;
    Listener listener_;
    GuestTransfers transfers_;
    std::list<Connection> connections_;
    Connection *owner_ = nullptr; // has the device, or waits for it
    std::unique_ptr<Descriptors> device_;
    std::map<uint32_t, uint32_t> unlinks_; // sequence number of the transfer: that of the request to end it
};

} // namespace bridge_sim
