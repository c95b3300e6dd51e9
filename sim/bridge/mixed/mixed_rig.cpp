#include "mixed_rig.h"

#include <stdexcept>

namespace bridge_sim
{

namespace
{

constexpr uint8_t BULK_ENDPOINT = WHISKER_LIMIT_USB_BULK_IN & 0xFu;
// Ticks without a disturbance before the model of bytes takes over: longer than any of them lasts.
constexpr uint64_t QUIET_TICKS = 16;
// With more than that the host is late: what the FIFO does about it is for the registers.
constexpr uint64_t BYTES_WAITING_MOST = 4 * WHISKER_LIMIT_BULK_PACKET;
constexpr uint64_t REST_CYCLES = 64;
constexpr unsigned PATIENCE = 1000;

} // namespace

MixedRig::MixedRig(size_t populated, uint64_t seed, const std::vector<NodeTrait> &traits, uint64_t rtl_ticks)
    : RtlRig(populated, seed, traits), bytes_(bus()), rtl_ticks_(rtl_ticks)
{
}

bool MixedRig::at_rtl() const
{
    return !at_bytes_;
}

// -------------------------------------------------------------------------------------- what is for the registers

bool MixedRig::enumerate(Descriptors &descriptors, const char *&error)
{
    disturbed();
    return RtlRig::enumerate(descriptors, error);
}

Outcome MixedRig::control(const SetupRequest &request, Bytes &data)
{
    disturbed();
    return RtlRig::control(request, data);
}

void MixedRig::arm(WireFault fault)
{
    disturbed();
    RtlRig::arm(fault);
}

// The host's frames are numbered on.
void MixedRig::power_up()
{
    if (at_bytes_) {
        host_.set_microframe(microframe_);
    }
    at_bytes_ = false;
    quiet_ = 0;
    RtlRig::power_up();
}

// ------------------------------------------------------------------------------------------------- plain sampling

Outcome MixedRig::in(uint8_t endpoint, size_t limit, Bytes &data)
{
    if (!at_bytes_) {
        return RtlRig::in(endpoint, limit, data);
    }
    if (endpoint != BULK_ENDPOINT || !bytes_.packet()) {
        return Outcome::NAK;
    }
    data = *bytes_.packet();
    taken_.push_back(data);
    bytes_.packet_taken();
    return Outcome::OK;
}

bool MixedRig::transfer(const std::function<bool()> &usb_step)
{
    quiet_++;
    if (rtl_ticks_ > 0) {
        rtl_ticks_--;
    } else if (!at_bytes_ && !try_bytes(usb_step)) {
        return finish_tick(usb_step);
    } else if (at_bytes_ && frame_bytes_waiting() > BYTES_WAITING_MOST) {
        disturbed();
    }
    return at_bytes_ ? byte_tick(usb_step) : RtlRig::transfer(usb_step);
}

// Only with no frame under way: neither in the bridge nor, in part, in the endpoint's buffer. False: the registers have
// the tick, for the host had something else for them.
bool MixedRig::try_bytes(const std::function<bool()> &usb_step)
{
    if (quiet_ < QUIET_TICKS || !running()) {
        return true;
    }
    const uint64_t packet = every_frame() ? WHISKER_FRAME_BYTES : WHISKER_LIMIT_BULK_PACKET;
    const auto whole = [this, packet] { return frame_bytes_waiting() > 0 && frame_bytes_waiting() % packet == 0; };
    if (!before_tick(whole, usb_step)) {
        return false;
    }
    if (frame_bytes_waiting() > 0) {
        return true;
    }
    RtlRig::idle(REST_CYCLES);
    bytes_.go_on(bridge_.settings(), bridge_.sampling());
    microframe_ = host_.microframe();
    at_bytes_ = true;
    mark();
    return true;
}

// What the host does within a tick, while `goes_on`, comes first here. False: it was for the registers, and so is the
// tick: it came after the tick's start.
bool MixedRig::before_tick(const std::function<bool()> &goes_on, const std::function<bool()> &usb_step)
{
    before_tick_ = true;
    while (before_tick_ && goes_on() && usb_step()) {
    }
    const bool quiet = before_tick_;
    before_tick_ = false;
    return quiet;
}

// Of a tick that the registers were to start. False: they did not.
bool MixedRig::finish_tick(const std::function<bool()> &usb_step)
{
    if (begun_) {
        end_tick(usb_step);
    }
    return begun_;
}

// The data toggle and the endpoint's two buffers stay where the registers have them: the host's toggle does, too.
void MixedRig::mark()
{
    marked_ = bytes_.sampling();
    marked_frame_ = microframe_;
    ticks_.clear();
    taken_.clear();
}

bool MixedRig::byte_tick(const std::function<bool()> &usb_step)
{
    if (!before_tick([] { return true; }, usb_step)) {
        return finish_tick(usb_step);
    }
    if (bytes_.drained()) {
        mark();
    }
    const unsigned frames = microframes(bytes_.tick_period());
    bytes_.tick(microframe_, frames);
    microframe_ += frames;
    ticks_.push_back({frames, bus().arrived()});
    return true;
}

// ----------------------------------------------------------------------------------------------- back to the registers

void MixedRig::disturbed()
{
    quiet_ = 0;
    if (at_bytes_) {
        back_to_registers();
    }
    if (before_tick_) {
        before_tick_ = false;
        begun_ = begin_tick();
    }
}

void MixedRig::back_to_registers()
{
    at_bytes_ = false;
    bridge_.go_on(marked_);
    host_.set_microframe(marked_frame_);
    RtlRig::idle(REST_CYCLES);
    Again again;
    for (const Tick &tick : ticks_) {
        make_again(tick, again);
    }
    bus().play(nullptr);
    for (unsigned i = 0; again.packets < taken_.size(); i++) {
        if (!take_again(again) || i > PATIENCE) {
            throw std::runtime_error("the registers do not make the packets that the model of bytes made");
        }
    }
}

void MixedRig::make_again(const Tick &tick, Again &again)
{
    bus().play(&tick.records);
    host_.start_of_frame();
    bridge_.start_tick();
    bridge_.cycle();
    for (unsigned i = 1; i < tick.microframes; i++) {
        host_.start_of_frame();
    }
    while (bridge_.link_busy()) {
        if (!take_again(again)) {
            bridge_.cycle();
        }
    }
    again.made += WHISKER_FRAME_BYTES;
}

// The next of the packets that the host has had, if there are bytes for it. False: there are not.
bool MixedRig::take_again(Again &again)
{
    if (again.packets == taken_.size() || again.taken + taken_[again.packets].size() > again.made) {
        return false;
    }
    Bytes packet;
    const Outcome outcome = RtlRig::in(BULK_ENDPOINT, WHISKER_LIMIT_BULK_PACKET, packet);
    if (outcome == Outcome::NAK) {
        RtlRig::idle(REST_CYCLES);
    } else if (outcome == Outcome::OK && packet == taken_[again.packets]) {
        again.taken += packet.size();
        again.packets++;
    } else {
        throw std::runtime_error("the registers make another packet than the model of bytes did");
    }
    return true;
}

} // namespace bridge_sim
