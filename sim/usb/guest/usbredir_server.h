// Serves the device over usbredir (protocol 0.7, libusbredirparser), as QEMU's `-device usb-redir` wants it: the guest
// then has it on an emulated controller of its own, bus resets included. One client at a time.
#pragma once

#include <memory>
#include <set>

#include <usbredirparser.h>

#include "guest_port.h"

namespace bridge_sim
{

class UsbredirServer : public GuestPort
{
  public:
    explicit UsbredirServer(uint16_t port);
    ~UsbredirServer() override;

    void plug(const Descriptors &descriptors) override;
    void unplug() override;
    std::vector<DeviceRequest> take_requests() override;
    void deliver(std::vector<Urb> completed) override;

  private:
    // What a transfer answers when it has ended.
    struct Pending {
        enum class Kind { CONTROL, BULK, INTERRUPT_IN, SET_CONFIGURATION, GET_CONFIGURATION, SET_ALT, GET_ALT, RESET };
        Kind kind = Kind::RESET;
        uint64_t id = 0; // the client's
        usb_redir_control_packet_header control{};
        usb_redir_bulk_packet_header bulk{};
        uint8_t endpoint = 0;  // INTERRUPT_IN
        uint8_t interface = 0; // SET_ALT, GET_ALT
        uint8_t value = 0;     // SET_CONFIGURATION, SET_ALT
    };
    struct ParserDeleter {
        void operator()(usbredirparser *parser) const;
    };
    struct Callbacks;

    void accept();
    void start_parser();
    void set_callbacks();
    void read();
    void write();
    void drop();
    void announce();
    void begin(Pending pending, GuestTransfer transfer);
    void request(Pending pending, const SetupRequest &setup);
    void end(const Pending &pending, const Urb &urb);
    void end_control(const Pending &pending, const Urb &urb);
    void end_bulk(const Pending &pending, const Urb &urb);
    void end_interrupt(const Pending &pending, const Urb &urb);
    void end_setting(const Pending &pending, const Urb &urb);
    void receive_interrupts(uint8_t endpoint);
    void stop_interrupts(uint8_t endpoint);
    void cancel(uint64_t id);

    std::unique_ptr<Stream> stream_;
    std::unique_ptr<usbredirparser, ParserDeleter> parser_;
    bool greeted_ = false; // the client has said hello
    std::unique_ptr<UsbLayout> device_;
    std::map<uint64_t, Pending> pending_; // by the name of the transfer
    std::set<uint8_t> interrupts_;        // endpoints whose packets the client wants as they come
    uint64_t next_name_ = 1;
    uint64_t interrupt_id_ = 0; // counts the packets sent of these
};

} // namespace bridge_sim
