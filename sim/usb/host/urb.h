// A USB transfer as host software asks for it and gets it back.
#pragma once

#include "usb_control.h"

namespace bridge_sim
{

enum class UrbKind { CONTROL, BULK_IN, INTERRUPT_IN, BUS_RESET };

// One transfer (USB request block), and what became of it.
struct Urb {
    uint64_t id = 0;
    UrbKind kind = UrbKind::CONTROL;
    SetupRequest setup; // CONTROL only
    Bytes data;         // to the device before, from the device after; actual length = its size
    size_t length = 0;  // bytes wanted from the device
    int status = 0;     // 0 or a negative errno, as usbfs reports it
};

} // namespace bridge_sim
