#include "ulpi_phy.h"

namespace bridge_sim
{

namespace
{

// ULPI 1.1: commands (3.8.1.1), RXCMD (3.8.1.2), registers (4.2)
constexpr uint8_t KIND = 0xC0, TRANSMIT = 0x40, WRITE = 0x80, ADDRESS = 0x3F, PID = 0x0F;
constexpr uint8_t RX_ACTIVE = 0x10, VBUS_VALID = 0x0C;
constexpr uint8_t FUNCTION_CONTROL = 0x04, FUNCTION_CONTROL_DEFAULT = 0x41, RESET = 0x20;
constexpr uint64_t RESET_CYCLES = 200;

} // namespace

UlpiPhy::UlpiPhy(const PhyTraits &traits)
    : traits_(traits), busy_(traits.late), function_control_(FUNCTION_CONTROL_DEFAULT)
{
}

unsigned UlpiPhy::answered_after() const
{
    return answers_ ? quiet_ : 0;
}

uint64_t UlpiPhy::aborted() const
{
    return aborted_;
}

bool UlpiPhy::transmitting() const
{
    return (command_ & KIND) == TRANSMIT;
}

// --------------------------------------------------------------------------------------------------- what the PHY says

void UlpiPhy::report_status(bool active)
{
    queue_.push_back({false, static_cast<uint8_t>(line_ | VBUS_VALID | (active ? RX_ACTIVE : 0))});
}

bool UlpiPhy::swapped() const
{
    return traits_.swap_register && swap_control_ != traits_.swap_value;
}

// With its lines swapped a PHY takes J for K, finds no packet, and is not understood.
void UlpiPhy::hear_bus(const UtmiToDevice &in)
{
    const bool one_line = in.line_state == LINE_J || in.line_state == LINE_K;
    const uint8_t line = swapped() && one_line ? in.line_state ^ (LINE_J | LINE_K) : in.line_state;
    const bool active = in.rx_active && !swapped();
    const bool changed = line_ != line || active_ != active;
    packet_waits_ = packet_waits_ || (active && !active_);
    line_ = line;
    active_ = active;
    if (changed) {
        report_status(active_);
    }
    if (in.rx_valid && active) {
        queue_.push_back({true, in.rx_data});
    }
}

PhyPins UlpiPhy::turn_around()
{
    aborted_ += command_ ? 1 : 0;
    command_ = 0;
    return {true, packet_waits_ && traits_.quick, 0xFF};
}

PhyPins UlpiPhy::leave_bus(bool tx_ready)
{
    const bool deaf = traits_.deaf > 0;
    return {false, command_ && !deaf && (tx_ready || !transmitting()), 0};
}

PhyPins UlpiPhy::say()
{
    const Said said = queue_.front();
    queue_.pop_front();
    const bool active = said.byte || (said.data & RX_ACTIVE);
    packet_ends_ = in_packet_ && !active;
    in_packet_ = active;
    packet_waits_ = packet_waits_ && !active;
    return {true, said.byte, said.data};
}

// A packet takes the bus whatever the link does; a status waits for the end of a command.
PhyPins UlpiPhy::speak(const UtmiToDevice &in)
{
    hear_bus(in);
    if (busy_ > 0) {
        queue_.clear();
        if (--busy_ == 0) {
            report_status(active_);
        }
        return pins_ = {true, false, 0};
    }
    if (queue_.empty()) {
        return pins_ = leave_bus(in.tx_ready);
    }
    if (!pins_.dir) {
        const bool waits = command_ && !packet_waits_;
        return pins_ = waits ? leave_bus(in.tx_ready) : turn_around();
    }
    return pins_ = say();
}

// -------------------------------------------------------------------------------------------------- what the link says

void UlpiPhy::begin(uint8_t data)
{
    command_ = data;
    accepted_ = false;
    answers_ = answer_due_ && transmitting() && (data & PID);
    answer_due_ = answer_due_ && !answers_;
}

void UlpiPhy::take(uint8_t data)
{
    if (accepted_) {
        value_ = data;
    }
    accepted_ = true;
}

void UlpiPhy::write(uint8_t address, uint8_t value)
{
    swap_control_ = traits_.swap_register && address == traits_.swap_register ? value : swap_control_;
    if (address != FUNCTION_CONTROL) {
        return;
    }
    const bool reset = (value & RESET) != 0;
    function_control_ = reset ? FUNCTION_CONTROL_DEFAULT : value;
    swap_control_ = reset ? 0 : swap_control_;
    busy_ = reset ? RESET_CYCLES : 0;
}

void UlpiPhy::finish()
{
    if (command_ && !accepted_) {
        traits_.deaf -= traits_.deaf > 0 ? 1 : 0; // the link gave up
    } else if ((command_ & KIND) == WRITE) {
        write(command_ & ADDRESS, value_);
    }
    command_ = 0;
}

// The packet's identifier comes within the command; a chirp has none.
uint8_t UlpiPhy::transmit_byte(uint8_t data) const
{
    const uint8_t pid = command_ & PID;
    return accepted_ ? data : static_cast<uint8_t>(pid ? pid | (~pid & PID) << 4 : 0);
}

void UlpiPhy::listen(const LinkPins &link, UtmiFromDevice &out)
{
    answers_ = false;
    out.tx_valid = transmitting() && !pins_.dir && !link.stp && !swapped();
    out.tx_data = transmit_byte(link.data);
    quiet_ = packet_ends_ ? 0 : quiet_ + 1;
    answer_due_ = answer_due_ || packet_ends_;
    packet_ends_ = false;
    if (!pins_.dir && link.stp) {
        finish();
    } else if (!pins_.dir && !command_ && link.data) {
        begin(link.data);
    } else if (!pins_.dir && command_ && pins_.nxt) {
        take(link.data);
    }
    out.xcvr_select = function_control_ & 3u;
    out.term_select = function_control_ >> 2 & 1u;
    out.op_mode = function_control_ >> 3 & 3u;
}

} // namespace bridge_sim
