#include "usb_layout.h"

#include <stdexcept>

namespace bridge_sim
{

namespace
{

// Descriptor types and lengths, USB 2.0 tables 9-5 to 9-13.
constexpr uint8_t INTERFACE = 4;
constexpr uint8_t ENDPOINT = 5;
constexpr size_t DEVICE_BYTES = 18;
constexpr size_t INTERFACE_BYTES = 9;
constexpr size_t ENDPOINT_BYTES = 7;
constexpr uint8_t TYPE_MASK = 3;

void require(bool ok)
{
    if (!ok) {
        throw std::runtime_error("a descriptor of the bridge is cut short");
    }
}

uint16_t word(const uint8_t *bytes)
{
    return static_cast<uint16_t>(bytes[0] | bytes[1] << 8);
}

UsbInterface read_interface(const uint8_t *bytes)
{
    return {bytes[5], bytes[6], bytes[7]};
}

UsbEndpoint read_endpoint(const uint8_t *bytes)
{
    return {bytes[2], static_cast<uint8_t>(bytes[3] & TYPE_MASK)};
}

void read_configuration(const Bytes &bytes, UsbLayout &layout)
{
    bool first_setting = false;
    for (size_t at = 0; at < bytes.size(); at += bytes[at]) {
        const uint8_t *one = bytes.data() + at;
        const size_t left = bytes.size() - at;
        require(left >= 2 && one[0] >= 2 && one[0] <= left);
        if (one[1] == INTERFACE) {
            require(one[0] >= INTERFACE_BYTES);
            first_setting = one[3] == 0;
            if (first_setting) {
                layout.interfaces.push_back(read_interface(one));
            }
        } else if (one[1] == ENDPOINT && first_setting) {
            require(one[0] >= ENDPOINT_BYTES);
            layout.endpoints.push_back(read_endpoint(one));
        }
    }
}

} // namespace

UsbLayout UsbLayout::parse(const Descriptors &descriptors)
{
    const Bytes &device = descriptors.device;
    require(device.size() >= DEVICE_BYTES);
    UsbLayout layout;
    layout.device_class = device[4];
    layout.device_subclass = device[5];
    layout.device_protocol = device[6];
    layout.vendor = word(device.data() + 8);
    layout.product = word(device.data() + 10);
    layout.release = word(device.data() + 12);
    read_configuration(descriptors.configuration, layout);
    return layout;
}

const UsbEndpoint *UsbLayout::endpoint(uint8_t address) const
{
    for (const UsbEndpoint &endpoint : endpoints) {
        if (endpoint.address == address) {
            return &endpoint;
        }
    }
    return nullptr;
}

} // namespace bridge_sim
