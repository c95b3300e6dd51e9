#include "usb_device.h"

#include "Vwhisker_usb.h"

namespace bridge_sim
{

namespace
{

// Of the 14 cycles that a ULPI link has for its answer (ULPI 1.1, section 3.8.2.6) the shim takes the rest:
// fpga/tb/ulpi counts with this number too.
constexpr unsigned DEVICE_DECIDES = 7;

} // namespace

UsbDevice::UsbDevice(uint64_t serial) : top_(std::make_unique<Vwhisker_usb>())
{
    top_->utmi_vbus_valid = 1;
    top_->utmi_session_valid = 1;
    top_->serial_number = serial;
    power_up(*top_);
}

UsbDevice::~UsbDevice() = default;

bool UsbDevice::suspended() const
{
    return top_->suspended;
}

unsigned UsbDevice::answer_limit() const
{
    return DEVICE_DECIDES;
}

void UsbDevice::cycle()
{
    Vwhisker_usb &top = *top_;
    top.utmi_rx_data = in.rx_data;
    top.utmi_rx_active = in.rx_active;
    top.utmi_rx_valid = in.rx_valid;
    top.utmi_tx_ready = in.tx_ready;
    top.utmi_line_state = in.line_state;
    clock(top, [&] {
        out.tx_data = top.utmi_tx_data;
        out.tx_valid = top.utmi_tx_valid;
        out.xcvr_select = top.utmi_xcvr_select;
        out.term_select = top.utmi_term_select;
        out.op_mode = top.utmi_op_mode;
    });
    time_answers();
}

// From the first edge with rx_active low to the first with tx_valid high.
void UsbDevice::time_answers()
{
    if (was_active_ && !in.rx_active) {
        waited_ = 0;
    } else if (waited_ != UINT32_MAX) {
        waited_++;
    }
    was_active_ = in.rx_active;
    if (out.tx_valid && waited_ != UINT32_MAX) {
        answered_after(waited_);
        waited_ = UINT32_MAX;
    }
}

} // namespace bridge_sim
