// What a device's descriptors say of its interfaces and endpoints (USB 2.0, 9.6).
#pragma once

#include "usb_control.h"

namespace bridge_sim
{

struct UsbEndpoint {
    uint8_t address = 0; // bit 7: to the host
    uint8_t type = 0;    // 0 control, 1 isochronous, 2 bulk, 3 interrupt
};

struct UsbInterface {
    uint8_t interface_class = 0;
    uint8_t subclass = 0;
    uint8_t protocol = 0;
};

struct UsbLayout {
    uint16_t vendor = 0;
    uint16_t product = 0;
    uint16_t release = 0;
    uint8_t device_class = 0;
    uint8_t device_subclass = 0;
    uint8_t device_protocol = 0;
    std::vector<UsbInterface> interfaces;
    std::vector<UsbEndpoint> endpoints;

    // Alternate settings but the first are passed over. Throws std::runtime_error when a descriptor is cut short.
    static UsbLayout parse(const Descriptors &descriptors);

    // The endpoint of this address; nullptr if there is none.
    const UsbEndpoint *endpoint(uint8_t address) const;
};

} // namespace bridge_sim
