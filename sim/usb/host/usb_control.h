// Control transfers and enumeration (USB 2.0, 8.5.3 and 9.4) on top of the host's transactions.
#pragma once

#include <functional>
#include <string>

#include "usb_host.h"

namespace bridge_sim
{

// The eight bytes of a SETUP packet, USB 2.0 table 9-2.
struct SetupRequest {
    uint8_t type = 0;
    uint8_t request = 0;
    uint16_t value = 0;
    uint16_t index = 0;
    uint16_t length = 0;

    static SetupRequest parse(const uint8_t bytes[8]);
    bool to_host() const;
};

// One control transfer on endpoint 0. To host: fills `data` (at most `length` bytes); to device: sends data[0, length).
// On success the host's toggles and address follow the request, as a host's driver would have them.
// STALL at any stage, or an error left after the retries, is the outcome.
Outcome control_transfer(UsbHost &host, const SetupRequest &request, Bytes &data);

// What enumeration read from the device itself.
struct Descriptors {
    Bytes device;
    Bytes configuration;
    std::string product{}, serial{}; // where they were asked for
    Bytes all() const;               // as sysfs shows them
    bool high_speed() const;         // an endpoint has packets that no other speed has
};

// Bus reset, address, descriptors, SET_CONFIGURATION(1). False: some step failed; `error` names it.
bool enumerate(UsbHost &host, Descriptors &descriptors, const char *&error);

// What follows the bus reset, whatever makes the control transfers.
using ControlTransfer = std::function<Outcome(const SetupRequest &, Bytes &)>;
bool configure(const ControlTransfer &transfer, Descriptors &descriptors, const char *&error);

} // namespace bridge_sim
