// A board under test: a USB device with nodes at its pins.
#pragma once

#include "utmi.h"

namespace bridge_sim
{

class Board : public UtmiDevice
{
  public:
    virtual bool led() const = 0;
    virtual bool bus_is_idle() const = 0; // the nodes' lines are as they are between two ticks
};

} // namespace bridge_sim
