#include "urb_scheduler.h"

#include <algorithm>
#include <cerrno>
#include <stdexcept>

namespace bridge_sim
{

namespace
{

constexpr uint8_t BULK_ENDPOINT = WHISKER_LIMIT_USB_BULK_IN & 0xFu;
constexpr uint8_t INTERRUPT_ENDPOINT = WHISKER_LIMIT_USB_HID_IN & 0xFu;
constexpr size_t INTERRUPT_PACKET = 64;
// A packet that is due moves from the FIFO to the endpoint's buffer at a byte per cycle; a poll takes some 20 cycles.
constexpr unsigned BULK_PATIENCE = 10000;
// Pause after a NAK: a frame is some 500 cycles on its way into the endpoint's buffer.
constexpr uint64_t NAK_REST_CYCLES = 64;

constexpr uint8_t HID_SET_REPORT_TYPE = 0x21;
constexpr uint8_t HID_SET_REPORT = 0x09;
constexpr uint16_t HID_FEATURE = 0x0300;
constexpr uint8_t SET_CONFIGURATION = 9, CLEAR_FEATURE = 1, SET_FEATURE = 3, SET_INTERFACE = 11;
constexpr uint8_t INTERFACE_TYPE = 0x01, ENDPOINT_TYPE = 0x02;
constexpr uint16_t ENDPOINT_HALT = 0;
constexpr uint8_t GET_STATUS_TYPE = 0x80;

} // namespace

int outcome_errno(Outcome outcome)
{
    switch (outcome) {
    case Outcome::OK:
        return 0;
    case Outcome::STALL:
        return -EPIPE;
    case Outcome::BABBLE:
        return -EOVERFLOW;
    case Outcome::TIMEOUT:
        return -ETIMEDOUT;
    case Outcome::CRC:
        return -EILSEQ;
    default:
        return -EPROTO;
    }
}

UrbScheduler::UrbScheduler(Rig &rig) : rig_(rig)
{
}

std::deque<Urb> &UrbScheduler::queue(UrbKind kind)
{
    switch (kind) {
    case UrbKind::BULK_IN:
        return bulk_;
    case UrbKind::INTERRUPT_IN:
        return interrupt_;
    default:
        return control_;
    }
}

void UrbScheduler::submit(Urb urb)
{
    std::deque<Urb> &waiting = queue(urb.kind);
    waiting.push_back(std::move(urb));
    if (!plugged_) {
        complete(waiting, -ENODEV);
    }
}

void UrbScheduler::plug(bool in)
{
    plugged_ = in;
    away_ = stop_seen_ = false;
    end_all({&control_, &bulk_, &interrupt_}, -ENODEV);
}

void UrbScheduler::end_all(std::initializer_list<std::deque<Urb> *> queues, int status)
{
    for (std::deque<Urb> *queue : queues) {
        while (!queue->empty()) {
            complete(*queue, status);
        }
    }
}

void UrbScheduler::discard(uint64_t id)
{
    for (std::deque<Urb> *queue : {&control_, &bulk_, &interrupt_}) {
        const auto at = std::find_if(queue->begin(), queue->end(), [id](const Urb &urb) { return urb.id == id; });
        if (at != queue->end()) {
            at->status = -ENOENT;
            completed_.push_back(std::move(*at));
            queue->erase(at);
            return;
        }
    }
}

void UrbScheduler::complete(std::deque<Urb> &queue, int status)
{
    queue.front().status = status;
    completed_.push_back(std::move(queue.front()));
    queue.pop_front();
}

std::vector<Urb> UrbScheduler::take_completed()
{
    std::vector<Urb> taken;
    taken.swap(completed_);
    return taken;
}

bool UrbScheduler::bulk_waiting() const
{
    return !bulk_.empty();
}

bool UrbScheduler::stop_seen() const
{
    return stop_seen_;
}

void UrbScheduler::poll_interrupt()
{
    interrupt_due_ = true;
}

void UrbScheduler::stay_away(bool away)
{
    away_ = away;
}

bool UrbScheduler::step()
{
    return step_control() || step_bulk() || step_interrupt();
}

// ---------------------------------------------------------------------------------------------------------- control

bool UrbScheduler::step_control()
{
    if (control_.empty()) {
        return false;
    }
    Urb &urb = control_.front();
    if (urb.kind == UrbKind::BUS_RESET) {
        bus_reset(urb);
    } else {
        run_control(urb);
    }
    complete(control_, urb.status);
    return true;
}

void UrbScheduler::run_control(Urb &urb)
{
    urb.status = outcome_errno(rig_.control(urb.setup, urb.data));
    if (urb.status == 0) {
        watch_run(urb);
        watch_halt(urb.setup);
    }
    if (urb.setup.type == 0 && urb.setup.request == SET_CONFIGURATION) {
        start_afresh();
    }
}

void UrbScheduler::watch_halt(const SetupRequest &setup)
{
    const bool feature =
        setup.type == ENDPOINT_TYPE && setup.value == ENDPOINT_HALT && setup.index == WHISKER_LIMIT_USB_BULK_IN;
    const bool interface = setup.type == INTERFACE_TYPE && setup.request == SET_INTERFACE &&
                           setup.index == WHISKER_LIMIT_USB_BULK_INTERFACE;
    if (feature && setup.request == SET_FEATURE) {
        halted_ = true;
    } else if (interface || (feature && setup.request == CLEAR_FEATURE)) {
        halted_ = false;
    }
}

// A bus reset or a new configuration ends the bridge's run, and the kernel ends what waits on the other endpoints.
void UrbScheduler::start_afresh()
{
    halted_ = false;
    rig_.forget_frames();
    end_all({&bulk_, &interrupt_}, -ESHUTDOWN);
}

// The report that starts and stops the bridge passes here; it holds which tick is a run's last.
void UrbScheduler::watch_run(const Urb &urb)
{
    const SetupRequest &setup = urb.setup;
    const bool control_report = setup.type == HID_SET_REPORT_TYPE && setup.request == HID_SET_REPORT &&
                                setup.value == (HID_FEATURE | WHISKER_REPORT_ID_CONTROL) &&
                                urb.data.size() == WHISKER_REPORT_CONTROL_BYTES;
    if (control_report) {
        stop_seen_ = urb.data[WHISKER_REPORT_CONTROL_RUN] == 0;
    }
}

void UrbScheduler::bus_reset(Urb &urb)
{
    Descriptors descriptors;
    const char *error = nullptr;
    urb.status = rig_.enumerate(descriptors, error) ? 0 : -ENODEV;
    start_afresh();
}

void UrbScheduler::damaged_setup()
{
    const SetupRequest get_status{GET_STATUS_TYPE, 0, 0, 0, 2};
    Bytes status;
    rig_.arm(WireFault::BAD_SETUP);
    if (rig_.control(get_status, status) != Outcome::OK) {
        throw std::runtime_error("the bridge did not answer GET_STATUS after a damaged SETUP");
    }
}

// ------------------------------------------------------------------------------------------------------------- bulk

bool UrbScheduler::step_bulk()
{
    if (bulk_.empty() || away_) {
        return false;
    }
    if (halted_ || rig_.ticks_by_itself()) {
        return receive_packet();
    }
    if (!rig_.bulk_packet_due()) {
        return futile_poll();
    }
    return !rig_.bulk_packet_later() && receive_packet();
}

bool UrbScheduler::receive_packet()
{
    const Outcome outcome = rig_.in(BULK_ENDPOINT, WHISKER_LIMIT_BULK_PACKET, packet_);
    bulk_naks_ = outcome == Outcome::NAK ? bulk_naks_ + 1 : 0;
    if (bulk_naks_ > BULK_PATIENCE && !rig_.ticks_by_itself()) {
        throw std::runtime_error("the bridge holds a frame and does not give it: bulk endpoint answers NAK");
    }
    if (outcome == Outcome::NAK) {
        rig_.idle(NAK_REST_CYCLES);
    } else {
        bulk_answer(outcome);
    }
    return true;
}

void UrbScheduler::bulk_answer(Outcome outcome)
{
    Urb &urb = bulk_.front();
    if (outcome != Outcome::OK) {
        complete(bulk_, outcome_errno(outcome));
        return;
    }
    rig_.bulk_packet_taken(packet_.size());
    if (urb.data.size() + packet_.size() > urb.length) {
        complete(bulk_, -EOVERFLOW);
        return;
    }
    urb.data.insert(urb.data.end(), packet_.begin(), packet_.end());
    if (packet_.size() < WHISKER_LIMIT_BULK_PACKET || urb.data.size() == urb.length) {
        complete(bulk_, 0);
    }
}

void UrbScheduler::nak_storm(unsigned polls)
{
    storm_left_ += polls;
}

bool UrbScheduler::futile_poll()
{
    if (storm_left_ == 0) {
        return false;
    }
    storm_left_--;
    if (rig_.in(BULK_ENDPOINT, WHISKER_LIMIT_BULK_PACKET, packet_) != Outcome::NAK) {
        throw std::runtime_error("the bridge gave data where none was due");
    }
    return true;
}

// -------------------------------------------------------------------------------------------------------- interrupt

bool UrbScheduler::step_interrupt()
{
    if (interrupt_.empty() || !interrupt_due_) {
        return false;
    }
    interrupt_due_ = false;
    const Outcome outcome = rig_.in(INTERRUPT_ENDPOINT, INTERRUPT_PACKET, packet_);
    if (outcome == Outcome::OK) {
        interrupt_.front().data = packet_;
    }
    if (outcome != Outcome::NAK) {
        complete(interrupt_, outcome_errno(outcome));
    }
    return true;
}

} // namespace bridge_sim
