#include "usb_device.h"

#include "Vwhisker_usb.h"

namespace bridge_sim
{

namespace
{

constexpr int RESET_CYCLES = 16;

} // namespace

UsbDevice::UsbDevice(uint64_t serial) : top_(std::make_unique<Vwhisker_usb>())
{
    top_->utmi_vbus_valid = 1;
    top_->utmi_session_valid = 1;
    top_->serial_number = serial;
    top_->rst = 1;
    for (int i = 0; i < RESET_CYCLES; i++) {
        cycle();
    }
    top_->rst = 0;
    cycle();
    restarts_ = 0;
}

UsbDevice::~UsbDevice() = default;

uint64_t UsbDevice::taken() const
{
    return taken_;
}

uint64_t UsbDevice::restarts() const
{
    return restarts_;
}

bool UsbDevice::suspended() const
{
    return top_->suspended;
}

void UsbDevice::cycle()
{
    Vwhisker_usb &top = *top_;
    top.utmi_rx_data = in.rx_data;
    top.utmi_rx_active = in.rx_active;
    top.utmi_rx_valid = in.rx_valid;
    top.utmi_tx_ready = in.tx_ready;
    top.utmi_line_state = in.line_state;
    top.stream_valid = taken_ < available;
    top.stream_data = top.stream_valid ? byte(taken_) : 0;
    top.clk = 0;
    top.eval();
    out.tx_data = top.utmi_tx_data;
    out.tx_valid = top.utmi_tx_valid;
    out.xcvr_select = top.utmi_xcvr_select;
    out.term_select = top.utmi_term_select;
    out.op_mode = top.utmi_op_mode;
    taken_ += top.stream_valid && top.stream_ready ? 1u : 0u;
    if (top.restart) {
        restarts_ += restarting_ ? 0u : 1u;
        taken_ = 0;
    }
    restarting_ = top.restart;
    top.clk = 1;
    top.eval();
    cycles++;
}

} // namespace bridge_sim
