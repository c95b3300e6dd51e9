#include "usbredir_words.h"

#include <cerrno>

namespace bridge_sim
{

namespace
{

constexpr size_t ENDPOINTS = 32; // of both directions, as the protocol numbers them
constexpr uint8_t TO_HOST = 0x80;
constexpr uint16_t CONTROL_PACKET = 64;

} // namespace

uint8_t status_of(int error)
{
    switch (error) {
    case 0:
        return usb_redir_success;
    case -EPIPE:
        return usb_redir_stall;
    case -ETIMEDOUT:
        return usb_redir_timeout;
    case -EOVERFLOW:
        return usb_redir_babble;
    case -EINVAL:
    case -ENOMEM:
        return usb_redir_inval;
    case -ENOENT:
    case -ESHUTDOWN:
    case -ENODEV:
        return usb_redir_cancelled;
    default:
        return usb_redir_ioerror;
    }
}

usb_redir_interface_info_header interface_info(const UsbLayout &layout)
{
    usb_redir_interface_info_header info{};
    for (const UsbInterface &interface : layout.interfaces) {
        const uint32_t at = info.interface_count++;
        info.interface[at] = interface.number;
        info.interface_class[at] = interface.interface_class;
        info.interface_subclass[at] = interface.subclass;
        info.interface_protocol[at] = interface.protocol;
    }
    return info;
}

usb_redir_ep_info_header endpoint_info(const UsbLayout &layout)
{
    usb_redir_ep_info_header info{};
    for (uint8_t &type : info.type) {
        type = usb_redir_type_invalid;
    }
    for (const size_t at : {size_t{0}, ENDPOINTS / 2}) {
        info.type[at] = usb_redir_type_control;
        info.max_packet_size[at] = CONTROL_PACKET;
    }
    for (const UsbEndpoint &endpoint : layout.endpoints) {
        const size_t at = (endpoint.address & 0xFu) + ((endpoint.address & TO_HOST) ? ENDPOINTS / 2 : 0);
        info.type[at] = endpoint.type;
        info.interval[at] = endpoint.interval;
        info.interface[at] = endpoint.interface;
        info.max_packet_size[at] = endpoint.packet;
    }
    return info;
}

usb_redir_device_connect_header connect_info(const UsbLayout &layout)
{
    usb_redir_device_connect_header header{};
    header.speed = usb_redir_speed_high;
    header.device_class = layout.device_class;
    header.device_subclass = layout.device_subclass;
    header.device_protocol = layout.device_protocol;
    header.vendor_id = layout.vendor;
    header.product_id = layout.product;
    header.device_version_bcd = layout.release;
    return header;
}

} // namespace bridge_sim
