// Makes the bridge visible to unmodified libusb and hidapi: a umockdev testbed device whose usbfs ioctls become
// transfers for the scheduler. The ioctls arrive in umockdev's thread; the model's thread only meets the two queues.
#pragma once

#include <functional>
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
    // A fresh testbed without a device.
    // Throws std::runtime_error with one line if that fails (for one, outside umockdev-wrapper).
    UsbfsServer();
    ~UsbfsServer();

    // Adds the device with these descriptors under a number it has not had yet, and tells udev's listeners.
    // Throws std::runtime_error with one line if that fails.
    void plug(const Descriptors &descriptors);

    // Removes it and tells udev's listeners. Who has it open gets ENODEV once every result handed over is fetched.
    void unplug();

    // Readable when requests wait.
    int wake_descriptor() const;

    // Requests since the last call, in order.
    std::vector<UsbfsRequest> take_requests();

    // Hands ended transfers to the clients that wait for them.
    void deliver(std::vector<Urb> completed);

  private:
    struct State;

    void post(std::function<void()> job);

    std::shared_ptr<State> state_;
};

} // namespace bridge_sim
