#include "usbfs_server.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <future>
#include <mutex>
#include <stdexcept>
#include <string>

#include <sys/eventfd.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "usbfs_session.h"

namespace bridge_sim
{

namespace
{

constexpr char DEVICE_PATH[] = "/devices/pci0000:00/0000:00:14.0/usb1/1-1";
constexpr unsigned FIRST_NUMBER = 2; // 1 is the root hub
constexpr unsigned NUMBERS = 60;     // that the device has in turn

// A device's number on its bus in three digits, as in the path of its node.
std::string three_digits(unsigned number)
{
    const std::string digits = std::to_string(number);
    return std::string(3 - digits.size(), '0') + digits;
}

std::string node_of(unsigned number)
{
    return "/dev/bus/usb/001/" + three_digits(number);
}

// The processes that are connected to umockdev's socket of a node. umockdev does not name them.
std::vector<pid_t> clients_of(const std::string &node)
{
    std::vector<pid_t> found;
    for (const auto &entry : std::filesystem::directory_iterator("/proc/self/fd")) {
        const int descriptor = std::stoi(entry.path().filename());
        sockaddr_un address{};
        socklen_t size = sizeof address - 1;
        ucred peer{};
        socklen_t room = sizeof peer;
        if (getsockname(descriptor, reinterpret_cast<sockaddr *>(&address), &size) == 0 &&
            address.sun_family == AF_UNIX && std::string(address.sun_path).find(node) != std::string::npos &&
            getsockopt(descriptor, SOL_SOCKET, SO_PEERCRED, &peer, &room) == 0 && peer.pid != getpid()) {
            found.push_back(peer.pid);
        }
    }
    return found;
}

// Neither dead nor stopped, by its state as of proc(5).
bool is_going_on(pid_t process)
{
    std::ifstream stat("/proc/" + std::to_string(process) + "/stat");
    std::string text;
    std::getline(stat, text);
    const size_t name_end = text.rfind(") ");
    return name_end != std::string::npos && std::string("TtZXx").find(text[name_end + 2]) == std::string::npos;
}

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
std::string device_record(const Descriptors &descriptors, const std::string &path, unsigned number)
{
    const Bytes &device = descriptors.device;
    const std::string hex = hexadecimal(descriptors.all());
    const std::string digits = three_digits(number);
    return "P: " + path + "\nN: bus/usb/001/" + digits + "=" + hex + "\nE: DEVNAME=" + node_of(number) +
           "\nE: DEVTYPE=usb_device\nE: SUBSYSTEM=usb\nE: MAJOR=189\nE: MINOR=" + std::to_string(number - 1) +
           "\nE: BUSNUM=001\nE: DEVNUM=" + digits + "\nA: busnum=1\\n\nA: devnum=" + std::to_string(number) +
           (descriptors.product.empty() ? "" : "\\n\nA: product=" + descriptors.product) +
           (descriptors.serial.empty() ? "" : "\\n\nA: serial=" + descriptors.serial) +
           "\\n\nA: speed=" + (descriptors.high_speed() ? "480" : "12") +
           "\\n\nA: bConfigurationValue=1\\n\nA: idVendor=" + hexadecimal({device[9], device[8]}) +
           "\\n\nA: idProduct=" + hexadecimal({device[11], device[10]}) + "\\n\nH: descriptors=" + hex + "\n\n";
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
    std::vector<DeviceRequest> inbox;
    GMainContext *context = nullptr; // of umockdev's thread, known from the first ioctl on
    int wake = -1;
    UsbfsSession session{[this](DeviceRequest request) { post(std::move(request)); }};
    UMockdevTestbed *testbed = nullptr;
    UMockdevIoctlBase *handler = nullptr;
    unsigned plugged = 0;           // times
    unsigned number = 0;            // of the device, now or before it was unplugged
    std::vector<std::string> nodes; // attached; clients of a device that is gone may still hold its node open

    ~State()
    {
        close(wake);
    }

    void post(DeviceRequest request)
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

using Job = std::function<void()>;

gboolean on_job(gpointer job)
{
    (*static_cast<Job *>(job))();
    return G_SOURCE_REMOVE;
}

void free_job(gpointer job)
{
    delete static_cast<Job *>(job);
}

} // namespace

// Runs it in umockdev's thread; here, while that has no client yet.
void UsbfsServer::post(std::function<void()> job)
{
    const std::lock_guard<std::mutex> lock(state_->mutex);
    g_main_context_invoke_full(state_->context, G_PRIORITY_DEFAULT, on_job, new Job(std::move(job)), free_job);
}

UsbfsServer::UsbfsServer() : state_(std::make_shared<State>())
{
    state_->wake = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    state_->testbed = umockdev_testbed_new();
    if (!umockdev_in_mock_environment()) {
        throw std::runtime_error("the simulated device needs umockdev: run this program under umockdev-wrapper");
    }
    state_->handler = umockdev_ioctl_base_new();
    g_signal_connect(state_->handler, "handle-ioctl", G_CALLBACK(State::on_ioctl), state_.get());
}

// umockdev announces the device before its descriptors are there, so listeners are notified once more.
void UsbfsServer::plug(const Descriptors &descriptors)
{
    GError *error = nullptr;
    state_->number = FIRST_NUMBER + state_->plugged++ % NUMBERS;
    const std::string node = node_of(state_->number);
    require(umockdev_testbed_attach_ioctl(state_->testbed, node.c_str(), state_->handler, &error), error,
            "umockdev does not serve the device node");
    state_->nodes.push_back(node);
    post([session = &state_->session, node] { session->set_node(node); });
    require(umockdev_testbed_add_from_string(state_->testbed,
                                             device_record(descriptors, DEVICE_PATH, state_->number).c_str(), &error),
            error, "umockdev does not take the device");
    umockdev_testbed_uevent(state_->testbed, ("/sys" + std::string(DEVICE_PATH)).c_str(), "add");
}

// Waits for umockdev's thread: after that no client of this device can hand in another request.
void UsbfsServer::unplug()
{
    std::promise<void> done;
    post([session = &state_->session, &done] {
        session->set_node("");
        done.set_value();
    });
    done.get_future().wait();
    const std::string path = "/sys" + std::string(DEVICE_PATH);
    umockdev_testbed_uevent(state_->testbed, path.c_str(), "remove");
    umockdev_testbed_remove_device(state_->testbed, path.c_str());
    unlink(node_of(state_->number).c_str()); // umockdev leaves it
}

// Dropping the testbed joins umockdev's thread; only then may the session go.
UsbfsServer::~UsbfsServer()
{
    for (const std::string &node : state_->nodes) {
        GError *error = nullptr;
        umockdev_testbed_detach_ioctl(state_->testbed, node.c_str(), &error);
        g_clear_error(&error);
    }
    g_object_unref(state_->testbed);
    g_object_unref(state_->handler);
}

bool UsbfsServer::host_lives() const
{
    const std::vector<pid_t> clients = clients_of(node_of(state_->number));
    return std::any_of(clients.begin(), clients.end(), is_going_on);
}

int UsbfsServer::wake_descriptor() const
{
    return state_->wake;
}

std::vector<DeviceRequest> UsbfsServer::take_requests()
{
    std::vector<DeviceRequest> taken;
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
    post([state = state_.get(), completed = std::move(completed)]() mutable {
        state->session.completed(std::move(completed));
    });
}

} // namespace bridge_sim
