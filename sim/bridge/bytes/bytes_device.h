// Level bytes: the USB device around the bridge, a transfer or a transaction at a time, configured and at high speed:
// which requests it serves (standard_requests.py, hid_requests.py), what its IN endpoints answer (endpoints.py).
#pragma once

#include "bytes_bridge.h"
#include "usb_control.h"

namespace bridge_sim
{

class BytesDevice
{
  public:
    explicit BytesDevice(BytesBridge &bridge);

    void power_up();
    void bus_reset();

    // A control transfer, as control_transfer() makes one: `data` and outcome are the same.
    Outcome control(const SetupRequest &request, Bytes &data);

    // An IN transaction on another endpoint, with what the host controller repeats of it.
    Outcome in(uint8_t endpoint, Bytes &data);

    // Faults on the wire leave no trace but in the counters and, if an ACK is lost, until the endpoint's next IN.
    void arm(WireFault fault);
    const HostCounters &counters() const;

  private:
    // The IN endpoints, in the order of their interfaces.
    static constexpr size_t ENDPOINTS = 2, BULK = 0, HID = 1;
    static constexpr std::array<uint16_t, ENDPOINTS> ADDRESS_OF = {WHISKER_LIMIT_USB_BULK_IN, WHISKER_LIMIT_USB_HID_IN};

    Outcome serve(const SetupRequest &request, Bytes &data);
    Outcome serve_standard(const SetupRequest &request, Bytes &data);
    Outcome serve_feature(const SetupRequest &request);
    Outcome serve_class(const SetupRequest &request, Bytes &data);
    Outcome serve_report(const SetupRequest &request, Bytes &data);
    Outcome status(const SetupRequest &request, Bytes &data) const;
    Outcome set_configuration(const SetupRequest &request);
    Outcome set_interface(const SetupRequest &request);
    bool interface_known(const SetupRequest &request) const;
    bool endpoint_known(const SetupRequest &request) const;
    Outcome bulk_in(Bytes &data);
    void restart();
    void set_halt(size_t endpoint, bool halted);
    bool use(WireFault fault);

    BytesBridge &bridge_;
    HostCounters counters_;
    WireFault armed_ = WireFault::NONE;
    std::array<bool, ENDPOINTS> halted_{};
    bool ack_lost_ = false; // of the bulk packet that is still in its buffer
    uint8_t address_ = 0;
    uint8_t configuration_ = 0;
    uint8_t idle_ = 0; // SET_IDLE's
};

} // namespace bridge_sim
