// The Verilated USB device without the bridge around it: frames come from a function, report registers read zero.
#pragma once

#include <functional>
#include <memory>

#include "utmi.h"

class Vwhisker_usb;

namespace bridge_sim
{

class UsbDevice : public UtmiDevice
{
  public:
    // After power-up. serial: 64 bits shown as serial number, 0: the text the device was generated with.
    explicit UsbDevice(uint64_t serial = 0);
    ~UsbDevice() override;

    void cycle() override;

    // Byte `index` (from 0) of the stream since the last restart, and whether the stream has it yet.
    std::function<uint8_t(uint64_t index)> byte;
    uint64_t available = 0; // bytes of the stream that may be taken

    uint64_t taken() const;    // bytes the device took since the last restart
    uint64_t restarts() const; // times it asked to begin anew (rising edges)
    bool suspended() const;

  private:
    std::unique_ptr<Vwhisker_usb> top_;
    uint64_t taken_ = 0;
    uint64_t restarts_ = 0;
    bool restarting_ = false;
};

} // namespace bridge_sim
