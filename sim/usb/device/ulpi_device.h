// The Verilated USB device behind ulpi_shim and a model of a ULPI PHY: the same host at the other end of the same
// wires.
#pragma once

#include <memory>

#include "stream_device.h"
#include "ulpi_phy.h"

class Vulpi_device;

namespace bridge_sim
{

class UlpiDevice : public StreamDevice
{
  public:
    // After power-up; the PHY may not have begun yet.
    explicit UlpiDevice(const PhyTraits &traits = {});
    ~UlpiDevice() override;

    void cycle() override;
    bool suspended() const override;
    unsigned answer_limit() const override;

    bool ready() const; // the PHY is set up
    const UlpiPhy &phy() const;

  private:
    std::unique_ptr<Vulpi_device> top_;
    UlpiPhy phy_;
    bool dir_before_ = true;
};

} // namespace bridge_sim
