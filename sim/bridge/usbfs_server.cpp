#include "usbfs_server.h"

#include <mutex>
#include <stdexcept>
#include <string>

#include <sys/eventfd.h>
#include <unistd.h>

#include "usbfs_session.h"

namespace bridge_sim
{

namespace
{

constexpr char DEVICE_NODE[] = "/dev/bus/usb/001/002";

std::string hexadecimal(const Bytes &bytes)
{
    static const char digits[] = "0123456789ABCDEF";
    std::string text;
    for (const uint8_t byte : bytes) {
        text += digits[byte >> 4];
        text += digits[byte & 0xFu];
    }
    return text;
}

// The device as udev and sysfs show it, in umockdev's format. What the descriptors say is read from them.
std::string device_record(const Descriptors &descriptors)
{
    const Bytes &device = descriptors.device;
    const std::string hex = hexadecimal(descriptors.all());
    const std::string vendor = hexadecimal({device[9], device[8]});
    const std::string product = hexadecimal({device[11], device[10]});
    return "P: /devices/pci0000:00/0000:00:14.0/usb1/1-1\n"
           "N: bus/usb/001/002=" +
           hex +
           "\n"
           "E: DEVNAME=" +
           DEVICE_NODE +
           "\nE: DEVTYPE=usb_device\nE: SUBSYSTEM=usb\n"
           "E: MAJOR=189\nE: MINOR=1\nE: BUSNUM=001\nE: DEVNUM=002\n"
           "A: busnum=1\\n\nA: devnum=2\\n\nA: speed=480\\n\nA: bConfigurationValue=1\\n\n"
           "A: idVendor=" +
           vendor + "\\n\nA: idProduct=" + product +
           "\\n\n"
           "H: descriptors=" +
           hex + "\n\n";
}

void require(bool ok, GError *error, const std::string &what)
{
    if (!ok) {
        throw std::runtime_error(what + ": " + (error ? error->message : "unknown reason"));
    }
}

} // namespace

// Shared with umockdev's thread.
struct UsbfsServer::State {
    std::mutex mutex;
    std::vector<UsbfsRequest> inbox;
    GMainContext *context = nullptr; // of umockdev's thread, known from the first ioctl on
    int wake = -1;
    UsbfsSession session{[this](UsbfsRequest request) { post(std::move(request)); }};
    UMockdevTestbed *testbed = nullptr;
    UMockdevIoctlBase *handler = nullptr;

    ~State()
    {
        close(wake);
    }

    void post(UsbfsRequest request)
    {
        const std::lock_guard<std::mutex> lock(mutex);
        inbox.push_back(std::move(request));
        eventfd_write(wake, 1);
    }

    static gboolean on_ioctl(UMockdevIoctlBase *, UMockdevIoctlClient *client, gpointer self)
    {
        auto *state = static_cast<State *>(self);
        {
            const std::lock_guard<std::mutex> lock(state->mutex);
            state->context = g_main_context_get_thread_default();
        }
        state->session.ioctl(client);
        return TRUE;
    }
};

namespace
{

struct Delivery {
    UsbfsSession *session;
    std::vector<Urb> urbs;
};

gboolean on_delivery(gpointer data)
{
    auto *delivery = static_cast<Delivery *>(data);
    delivery->session->completed(std::move(delivery->urbs));
    return G_SOURCE_REMOVE;
}

void free_delivery(gpointer data)
{
    delete static_cast<Delivery *>(data);
}

} // namespace

UsbfsServer::UsbfsServer(const Descriptors &descriptors) : state_(std::make_shared<State>())
{
    GError *error = nullptr;
    state_->wake = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    state_->testbed = umockdev_testbed_new();
    if (!umockdev_in_mock_environment()) {
        throw std::runtime_error("the simulated device needs umockdev: run this program under umockdev-wrapper");
    }
    require(umockdev_testbed_add_from_string(state_->testbed, device_record(descriptors).c_str(), &error), error,
            "umockdev does not take the device");
    state_->handler = umockdev_ioctl_base_new();
    g_signal_connect(state_->handler, "handle-ioctl", G_CALLBACK(State::on_ioctl), state_.get());
    require(umockdev_testbed_attach_ioctl(state_->testbed, DEVICE_NODE, state_->handler, &error), error,
            "umockdev does not serve the device node");
}

// Dropping the testbed joins umockdev's thread; only then may the session go.
UsbfsServer::~UsbfsServer()
{
    GError *error = nullptr;
    umockdev_testbed_detach_ioctl(state_->testbed, DEVICE_NODE, &error);
    g_clear_error(&error);
    g_object_unref(state_->testbed);
    g_object_unref(state_->handler);
}

int UsbfsServer::wake_descriptor() const
{
    return state_->wake;
}

std::vector<UsbfsRequest> UsbfsServer::take_requests()
{
    std::vector<UsbfsRequest> taken;
    const std::lock_guard<std::mutex> lock(state_->mutex);
    eventfd_t count = 0;
    eventfd_read(state_->wake, &count);
    taken.swap(state_->inbox);
    return taken;
}

void UsbfsServer::deliver(std::vector<Urb> completed)
{
    if (completed.empty()) {
        return;
    }
    auto *delivery = new Delivery{&state_->session, std::move(completed)};
    const std::lock_guard<std::mutex> lock(state_->mutex);
    g_main_context_invoke_full(state_->context, G_PRIORITY_DEFAULT, on_delivery, delivery, free_delivery);
}

} // namespace bridge_sim
