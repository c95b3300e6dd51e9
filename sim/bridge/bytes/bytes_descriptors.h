// Level bytes: the device's descriptors, a table that bytes_descriptors.py makes of fpga/usb/descriptors.py.
#pragma once

#include <vector>

#include "usb_packet.h"

namespace bridge_sim
{

struct Descriptor {
    uint8_t type;
    uint8_t index;
    Bytes bytes;
};

extern const std::vector<Descriptor> DESCRIPTORS;

} // namespace bridge_sim
