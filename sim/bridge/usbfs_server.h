// Makes the bridge visible to unmodified libusb and hidapi: a umockdev testbed device whose usbfs ioctls become
// transfers for the scheduler. The ioctls arrive in umockdev's thread; the model's thread only meets the two queues.
#pragma once

#include <memory>
#include <vector>

#include "urb_scheduler.h"

namespace bridge_sim
{

// What a client wants of the model.
struct UsbfsRequest {
    bool discard = false; // else submit
    Urb urb;              // discard: only its id counts
};

class UsbfsServer
{
  public:
    // Adds the device with these descriptors to a fresh testbed and attaches to its node.
    // Throws std::runtime_error with one line if that fails (for one, outside umockdev-wrapper).
    explicit UsbfsServer(const Descriptors &descriptors);
    ~UsbfsServer();

    // Readable when requests wait.
    int wake_descriptor() const;

    // Requests since the last call, in order.
    std::vector<UsbfsRequest> take_requests();

    // Hands ended transfers to the clients that wait for them.
    void deliver(std::vector<Urb> completed);

  private:
    struct State;
    std::shared_ptr<State> state_;
};

} // namespace bridge_sim
