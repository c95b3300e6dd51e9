// Makes the bridge visible to unmodified libusb and hidapi: a umockdev testbed device whose usbfs ioctls become
// transfers for the scheduler. The ioctls arrive in umockdev's thread; the model's thread only meets the two queues.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "device_port.h"

namespace bridge_sim
{

class UsbfsServer : public DevicePort
{
  public:
    // A fresh testbed without a device. Throws std::runtime_error with one line if that fails (for one, outside
    // umockdev-wrapper).
    UsbfsServer();
    ~UsbfsServer() override;

    // Adds the device with these descriptors under a number it has not had yet, and notifies udev's listeners.
    // Throws std::runtime_error with one line if that fails.
    void plug(const Descriptors &descriptors) override;

    // Removes it and notifies udev's listeners. Who has it open gets ENODEV once every result handed over is fetched.
    void unplug() override;

    // By the kernel's word about the processes that have the device open, so that the machine's speed decides nothing.
    bool host_lives() const override;
    int wake_descriptor() const override;
    std::vector<DeviceRequest> take_requests() override;
    void deliver(std::vector<Urb> completed) override;

  private:
    struct State;

    void post(std::function<void()> job);

    std::shared_ptr<State> state_;
};

} // namespace bridge_sim
