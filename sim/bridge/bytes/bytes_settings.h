// Level bytes: the settings behind HID report `control` and their limits (control_registers.v).
#pragma once

#include "usb_packet.h"
#include "whisker_protocol.h"

namespace bridge_sim
{

struct LinkSettings {
    uint8_t sck_divider = WHISKER_LIMIT_SCK_DIVIDER_DEFAULT;   // cycles of 60 MHz
    uint8_t word_gap = WHISKER_LIMIT_WORD_GAP_DEFAULT;         // .
    uint8_t sample_point = WHISKER_LIMIT_SAMPLE_POINT_DEFAULT; // .
    uint8_t options = 0;                                       // bits of control_options
    uint32_t lane_mask = UINT32_MAX >> (32 - WHISKER_LIMIT_LANES);
    uint32_t tick_period = WHISKER_LIMIT_TICK_PERIOD; // .

    // Of a control report; its length, id, wire version and reserved bytes are the caller's to check.
    static LinkSettings of_report(const Bytes &report);
    void put(Bytes &report) const;

    bool valid() const;

    // Does a second window fit in a tick (service_store.v)?
    bool service_fits() const;
};

} // namespace bridge_sim
