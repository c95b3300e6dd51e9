// Which device a test program tests: the one on UTMI, or with the word `ulpi` the one behind shim and PHY.
#pragma once

#include <cstring>
#include <memory>

#include "ulpi_device.h"
#include "usb_device.h"

namespace bridge_sim
{

class DeviceKind
{
  public:
    DeviceKind(int argc, char **argv) : ulpi_(argc > 1 && std::strcmp(argv[1], "ulpi") == 0)
    {
    }
    std::unique_ptr<StreamDevice> make() const
    {
        if (ulpi_) {
            return std::make_unique<UlpiDevice>();
        }
        return std::make_unique<UsbDevice>();
    }

  private:
    bool ulpi_;
};

} // namespace bridge_sim
