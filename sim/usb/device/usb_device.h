// The Verilated USB device without the bridge around it: frames come from a function, report registers read zero.
#pragma once

#include <memory>

#include "stream_device.h"

class Vwhisker_usb;

namespace bridge_sim
{

class UsbDevice : public StreamDevice
{
  public:
    // After power-up. serial: 64 bits shown as serial number, 0: the text the device was generated with.
    explicit UsbDevice(uint64_t serial = 0);
    ~UsbDevice() override;

    void cycle() override;
    bool suspended() const override;
    unsigned answer_limit() const override;

  private:
    void time_answers();

    std::unique_ptr<Vwhisker_usb> top_;
    unsigned waited_ = UINT32_MAX; // cycles since the end of a packet; UINT32_MAX: no answer is due
    bool was_active_ = false;
};

} // namespace bridge_sim
