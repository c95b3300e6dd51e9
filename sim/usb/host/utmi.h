// The UTMI boundary between the USB host model (which plays PHY and host controller) and a device, one call per clock.
#pragma once

#include <cstdint>

namespace bridge_sim
{

// Line states of UTMI, table 3 of the UTMI 1.05 specification.
enum LineState : uint8_t { LINE_SE0 = 0, LINE_J = 1, LINE_K = 2 };

// What the PHY drives.
struct UtmiToDevice {
    uint8_t rx_data = 0;
    uint8_t rx_active = 0;
    uint8_t rx_valid = 0;
    uint8_t tx_ready = 0;
    uint8_t line_state = LINE_J;
};

// What the device drives.
struct UtmiFromDevice {
    uint8_t tx_data = 0;
    uint8_t tx_valid = 0;
    uint8_t xcvr_select = 0;
    uint8_t term_select = 0;
    uint8_t op_mode = 0;
};

class UtmiDevice
{
  public:
    virtual ~UtmiDevice() = default;

    // One cycle of the 60 MHz clock. Before: `in` holds the levels at the rising edge. After: `out` holds the levels
    // the device showed at that same edge, so a byte moved if in.tx_ready and out.tx_valid are both set.
    virtual void cycle() = 0;

    UtmiToDevice in;
    UtmiFromDevice out;
    uint64_t cycles = 0;
};

} // namespace bridge_sim
