#include "usbfs_connection.h"

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "whisker_protocol.h"

namespace bridge_sim
{

namespace
{

constexpr unsigned HOLD_MS = 10, FIRST_HOLD_MS = 1;
constexpr size_t SETUP_BYTES = 8;

UMockdevIoctlData *resolve(UMockdevIoctlData *data, size_t offset, size_t size)
{
    GError *error = nullptr;
    UMockdevIoctlData *resolved = umockdev_ioctl_data_resolve(data, offset, size, &error);
    g_clear_error(&error);
    return resolved;
}

usbdevfs_urb *native(UMockdevIoctlData *data)
{
    return reinterpret_cast<usbdevfs_urb *>(data->data);
}

bool kind_of(const usbdevfs_urb &urb, UrbKind &kind)
{
    if (urb.type == USBDEVFS_URB_TYPE_CONTROL && urb.buffer_length >= static_cast<int>(SETUP_BYTES)) {
        kind = UrbKind::CONTROL;
    } else if (urb.type == USBDEVFS_URB_TYPE_BULK && urb.endpoint == WHISKER_LIMIT_USB_BULK_IN) {
        kind = UrbKind::BULK_IN;
    } else if (urb.type == USBDEVFS_URB_TYPE_INTERRUPT && urb.endpoint == WHISKER_LIMIT_USB_HID_IN) {
        kind = UrbKind::INTERRUPT_IN;
    } else {
        return false;
    }
    return true;
}

} // namespace

UsbfsConnection::UsbfsConnection(UMockdevIoctlClient *client) : client_(client), hold_ms_(HOLD_MS)
{
    g_object_add_toggle_ref(G_OBJECT(client_), on_last_reference, this);
}

UsbfsConnection::~UsbfsConnection()
{
    stop_holding();
    if (died_) {
        g_object_ref(client_); // its socket is open for good, of which umockdev would complain
    }
    g_object_remove_toggle_ref(G_OBJECT(client_), on_last_reference, this);
}

// umockdev keeps a client while it answers it and while it waits for its next ioctl. It lets go of one that was killed
// before it had the answer without closing it.
void UsbfsConnection::on_last_reference(gpointer self, GObject *, gboolean last)
{
    auto *connection = static_cast<UsbfsConnection *>(self);
    if (last && connection->answered_ && umockdev_ioctl_client_get_connected(connection->client_)) {
        connection->died_ = true;
    }
}

void UsbfsConnection::asked()
{
    answered_ = false;
}

bool UsbfsConnection::closed() const
{
    return died_ || !umockdev_ioctl_client_get_connected(client_);
}

std::string UsbfsConnection::node() const
{
    const char *path = umockdev_ioctl_client_get_devnode(client_);
    return path ? path : "";
}

void UsbfsConnection::unplugged()
{
    gone_ = true;
    if (reaping_) {
        stop_holding();
        reap(true);
    }
}

unsigned long UsbfsConnection::request() const
{
    return umockdev_ioctl_client_get_request(client_);
}

gulong UsbfsConnection::argument() const
{
    gulong value = 0;
    std::memcpy(&value, umockdev_ioctl_client_get_arg(client_)->data, sizeof value);
    return value;
}

UMockdevIoctlData *UsbfsConnection::argument_data(size_t size) const
{
    return resolve(umockdev_ioctl_client_get_arg(client_), 0, size);
}

// To one that died there is no answer: umockdev would wait for it for good.
void UsbfsConnection::answer(int error)
{
    if (died_) {
        return;
    }
    answered_ = true;
    umockdev_ioctl_client_complete(client_, error ? -1 : 0, error);
}

// -------------------------------------------------------------------------------------------------------- submitting

int UsbfsConnection::read_urb(Urb &urb)
{
    reading_.urb.reset(argument_data(sizeof(usbdevfs_urb)));
    reading_.buffer.reset();
    died_ = !reading_.urb;
    if (died_) {
        return EFAULT;
    }
    const usbdevfs_urb &given = *native(reading_.urb.get());
    const auto size = static_cast<size_t>(std::max(given.buffer_length, 0));
    if (!kind_of(given, urb.kind)) {
        return ENOENT;
    }
    if (size > 0) {
        reading_.buffer.reset(resolve(reading_.urb.get(), offsetof(usbdevfs_urb, buffer), size));
    }
    died_ = size > 0 && !reading_.buffer;
    if (died_) {
        return EFAULT;
    }
    urb.length = size;
    if (urb.kind == UrbKind::CONTROL) {
        const uint8_t *bytes = reading_.buffer->data;
        urb.setup = SetupRequest::parse(bytes);
        urb.length = size - SETUP_BYTES;
        if (urb.setup.length > urb.length) {
            return EINVAL;
        }
        urb.data.assign(bytes + SETUP_BYTES, bytes + size);
    }
    return 0;
}

void UsbfsConnection::in_flight(uint64_t id)
{
    transfers_[id] = std::move(reading_);
}

uint64_t UsbfsConnection::find(gulong address) const
{
    for (const auto &[id, transfer] : transfers_) {
        if (transfer.urb->client_addr == address) {
            return id;
        }
    }
    return 0;
}

// ------------------------------------------------------------------------------------------------------------- ending

void UsbfsConnection::wait_for(uint64_t id)
{
    waited_for_ = id;
}

void UsbfsConnection::ended(const Urb &urb)
{
    if (urb.id == waited_for_) {
        waited_for_ = 0;
        answer(-urb.status);
        return;
    }
    const auto at = transfers_.find(urb.id);
    if (at == transfers_.end()) {
        return;
    }
    fill(at->second, urb);
    hold_ms_ = 0;
    done_.push_back(std::move(at->second.urb));
    transfers_.erase(at);
    if (reaping_) {
        hand_over();
    }
}

void UsbfsConnection::fill(Transfer &transfer, const Urb &urb)
{
    usbdevfs_urb *given = native(transfer.urb.get());
    const bool control = urb.kind == UrbKind::CONTROL;
    const bool written = !control || urb.setup.to_host();
    const size_t count = std::min(urb.data.size(), urb.length);
    given->status = urb.status;
    given->actual_length = control && urb.status != 0 ? 0 : static_cast<int>(count);
    if (written && count > 0) {
        std::memcpy(transfer.buffer->data + (control ? SETUP_BYTES : 0), urb.data.data(), count);
    }
}

void UsbfsConnection::reap(bool wait)
{
    reaping_ = true;
    if (!done_.empty()) {
        hand_over();
    } else if (gone_) {
        reaping_ = false;
        answer(ENODEV);
    } else if (!wait && hold_ms_ == 0) {
        not_yet();
    } else if (!wait) {
        hold_ = g_timeout_source_new(hold_ms_);
        g_source_set_callback(hold_, on_hold_over, this, nullptr);
        g_source_attach(hold_, g_main_context_get_thread_default());
    }
}

void UsbfsConnection::not_yet()
{
    reaping_ = false;
    hold_ms_ = hold_ms_ == 0 ? FIRST_HOLD_MS : std::min(2 * hold_ms_, HOLD_MS);
    if (const IoctlDataRef pointer = living_argument()) {
        answer(EAGAIN);
    }
}

int UsbfsConnection::on_hold_over(void *self)
{
    auto *connection = static_cast<UsbfsConnection *>(self);
    connection->stop_holding();
    connection->not_yet();
    return G_SOURCE_REMOVE;
}

void UsbfsConnection::stop_holding()
{
    if (hold_) {
        g_source_destroy(hold_);
        g_source_unref(hold_);
        hold_ = nullptr;
    }
}

void UsbfsConnection::hand_over()
{
    stop_holding();
    reaping_ = false;
    if (const IoctlDataRef pointer = living_argument()) {
        umockdev_ioctl_data_set_ptr(pointer.get(), 0, done_.front().get());
        done_.pop_front();
        answer(0);
    }
}

// umockdev does not notice that a process was killed in an ioctl; reading its memory shows it.
IoctlDataRef UsbfsConnection::living_argument()
{
    IoctlDataRef pointer(argument_data(sizeof(void *)));
    died_ = !pointer;
    return pointer;
}

} // namespace bridge_sim
