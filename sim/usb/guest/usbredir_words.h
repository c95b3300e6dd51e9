// The device and its errors in usbredir's words.
#pragma once

#include <usbredirproto.h>

#include "usb_layout.h"

namespace bridge_sim
{

// Of a transfer that ended with this errno, negative, or 0.
uint8_t status_of(int error);

usb_redir_interface_info_header interface_info(const UsbLayout &layout);
usb_redir_ep_info_header endpoint_info(const UsbLayout &layout);
usb_redir_device_connect_header connect_info(const UsbLayout &layout);

} // namespace bridge_sim
