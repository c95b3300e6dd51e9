// Where the simulated bridge is plugged in: what carries a host's transfers to the model and their results back.
#pragma once

#include <vector>

#include "urb.h"

namespace bridge_sim
{

// What the host wants of the model.
struct DeviceRequest {
    bool discard = false; // else submit
    Urb urb;              // discard: only its id counts
};

class DevicePort
{
  public:
    DevicePort() = default;
    virtual ~DevicePort() = default;
    DevicePort(const DevicePort &) = delete;
    DevicePort &operator=(const DevicePort &) = delete;

    // The device with these descriptors is there from now on. Throws std::runtime_error with one line if that fails.
    virtual void plug(const Descriptors &descriptors) = 0;

    // The cable is pulled; every result handed over before still reaches the host.
    virtual void unplug() = 0;

    // Will a host that takes nothing take frames again by itself? Not one that was stopped or has left.
    virtual bool host_lives() const
    {
        return true;
    }

    // Readable when requests wait.
    virtual int wake_descriptor() const = 0;

    // Requests since the last call, in order.
    virtual std::vector<DeviceRequest> take_requests() = 0;

    // Hands ended transfers to the host. May lead to requests at once, for which nothing wakes.
    virtual void deliver(std::vector<Urb> completed) = 0;
};

} // namespace bridge_sim
