// The clients of the emulated usbfs node: one per open file, each with its own transfers and its own queue of results,
// as in the kernel. Everything here runs in umockdev's thread.
#pragma once

#include <functional>
#include <map>
#include <string>

#include <linux/usbdevice_fs.h>
#include <umockdev.h>

#include "device_port.h"
#include "usbfs_connection.h"

namespace bridge_sim
{

class UsbfsSession
{
  public:
    // post: hands a request to the model; may be called until the session's end.
    explicit UsbfsSession(std::function<void(DeviceRequest)> post);

    // One ioctl of a client; answered now, or later when a transfer has ended.
    void ioctl(UMockdevIoctlClient *client);

    // The device has this node from now on; empty: it is unplugged. Clients of an earlier node have lost it.
    void set_node(const std::string &node);

    // Transfers the model has ended.
    void completed(std::vector<Urb> urbs);

  private:
    void submit(UsbfsConnection &connection);
    void discard(UsbfsConnection &connection);
    void claim(UsbfsConnection &connection);
    void release(UsbfsConnection &connection);
    void control(UsbfsConnection &connection, const SetupRequest &setup, bool bus_reset);
    void set_configuration(UsbfsConnection &connection);
    void clear_halt(UsbfsConnection &connection);
    void capabilities(UsbfsConnection &connection);
    UsbfsConnection &connection_of(UMockdevIoctlClient *client);
    void ioctl_of_lost_device(UsbfsConnection &connection);
    void forget_closed();

    std::function<void(DeviceRequest)> post_;
    std::map<UMockdevIoctlClient *, std::unique_ptr<UsbfsConnection>> connections_;
    std::map<uint64_t, UsbfsConnection *> owners_;     // of transfers in the model
    std::map<unsigned, UsbfsConnection *> interfaces_; // claimed
    std::string node_;
    uint64_t next_id_ = 1;
};

} // namespace bridge_sim
