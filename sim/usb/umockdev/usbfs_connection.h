// One open file of the emulated usbfs node: its transfers in flight, its ended transfers, and the ioctl it waits in.
#pragma once

#include <deque>
#include <map>
#include <memory>
#include <string>

#include <linux/types.h>
#include <linux/usbdevice_fs.h>
#include <umockdev.h>

#include "urb.h"

namespace bridge_sim
{

struct Unref {
    void operator()(void *object) const
    {
        g_object_unref(object);
    }
};
using IoctlDataRef = std::unique_ptr<UMockdevIoctlData, Unref>;

class UsbfsConnection
{
  public:
    explicit UsbfsConnection(UMockdevIoctlClient *client);
    ~UsbfsConnection();
    UsbfsConnection(const UsbfsConnection &) = delete;
    UsbfsConnection &operator=(const UsbfsConnection &) = delete;

    bool closed() const;

    // The device node that the client opened.
    std::string node() const;

    // The device is gone: a client that waits for a result learns it (ENODEV) when all results are taken.
    void unplugged();

    // The request the client is in, its argument as a number, and as memory of the given size (nullptr: unreadable).
    unsigned long request() const;
    gulong argument() const;
    UMockdevIoctlData *argument_data(size_t size) const;

    // An ioctl of the client has come.
    void asked();

    // Ends the client's ioctl: error 0, or a positive errno.
    void answer(int error);

    // Reads the client's URB into a transfer. Returns 0, or a positive errno if there is no such endpoint or memory.
    int read_urb(Urb &urb);

    // A transfer read by read_urb() is in the model now.
    void in_flight(uint64_t id);

    // Id of the transfer in flight whose usbfs_urb lies at this address of the client, 0 if none.
    uint64_t find(gulong address) const;

    // A transfer has ended. Answers a waiting reap, or a waiting ioctl that stands for a transfer.
    void ended(const Urb &urb);

    // USBDEVFS_REAPURB and its non-blocking form. usbfs is a plain file here and always looks ready to poll(), so that
    // libusb would spin. So the non-blocking form waits up to HOLD_MS for a result. While it waits, libusb neither
    // submits nor reports what it has reaped. So the first such call after a result does not wait, and the next ones
    // wait for 1 ms, 2 ms and so on, up to HOLD_MS.
    void reap(bool wait);

    // The client's ioctl is answered when this transfer has ended.
    void wait_for(uint64_t id);

  private:
    struct Transfer {
        IoctlDataRef urb;
        IoctlDataRef buffer;
    };

    static void on_last_reference(gpointer self, GObject *client, gboolean last);
    static int on_hold_over(void *self);
    IoctlDataRef living_argument();
    void hand_over();
    void fill(Transfer &transfer, const Urb &urb);
    void stop_holding();
    void not_yet();

    UMockdevIoctlClient *client_;
    Transfer reading_; // between read_urb() and in_flight()
    std::map<uint64_t, Transfer> transfers_;
    std::deque<IoctlDataRef> done_;
    bool reaping_ = false;
    GSource *hold_ = nullptr;
    unsigned hold_ms_; // of the next reap that finds nothing
    uint64_t waited_for_ = 0;
    bool answered_ = false; // its ioctl
    bool gone_ = false;     // the device
    bool died_ = false;     // the client
};

} // namespace bridge_sim
