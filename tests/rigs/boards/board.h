// A board under test: a USB device with nodes at its pins.
#pragma once

#include "utmi.h"

namespace bridge_sim
{

constexpr uint8_t LED_PHY = 1, LED_CONFIGURED = 2, LED_RUN = 4, LED_ERROR = 8;

class Board : public UtmiDevice
{
  public:
    // Bits: the PHY is set up, configured, a run is in progress, error.
    virtual uint8_t leds() const = 0;
    virtual bool bus_is_idle() const = 0; // the nodes' lines are as they are between two ticks
};

} // namespace bridge_sim
