#include "ticking_bridge.h"

#include <algorithm>
#include <stdexcept>

#include "frame_check.h"
#include "usb_control.h"

namespace bridge_sim
{

namespace
{

constexpr uint64_t MICROFRAME = WHISKER_LIMIT_CLOCK_HZ / 8000;
constexpr uint32_t SETTLED = 20; // ticks after which the nodes have readings
constexpr uint64_t SEED = 1;

class TickingBridge : public UtmiDevice
{
  public:
    TickingBridge(bool own_ticks, std::vector<uint64_t> &syncs)
        : nodes_(LANES, SEED), bridge_(nodes_, flash_), syncs_(syncs)
    {
        nodes_.power_on();
        bridge_.run_nodes_by_itself();
        if (own_ticks) {
            bridge_.tick_by_itself();
        }
    }

    // From the next cycle on a tick every `period` cycles (at least 1), until so many were asked for.
    void ask(uint64_t period, uint64_t ticks)
    {
        period_ = period;
        left_ = ticks;
        wait_ = 0;
    }

    bool all_asked() const
    {
        return left_ == 0;
    }

    bool running() const
    {
        return bridge_.running();
    }

    void cycle() override
    {
        bridge_.in = in;
        if (left_ > 0 && wait_ == 0) {
            bridge_.start_tick();
            left_--;
            wait_ = period_;
        } else {
            bridge_.cycle();
        }
        wait_ -= wait_ > 0 ? 1 : 0;
        out = bridge_.out;
        cycles++;
        if (bridge_.sync() && !sync_) {
            syncs_.push_back(cycles);
        }
        sync_ = bridge_.sync();
    }

  private:
    NodeBus nodes_;
    NorFlash flash_;
    BridgeModel bridge_;
    std::vector<uint64_t> &syncs_;
    bool sync_ = false;
    uint64_t period_ = 1;
    uint64_t left_ = 0; // ticks to ask for
    uint64_t wait_ = 0; // cycles until the next
};

class Session
{
  public:
    explicit Session(const RunSettings &settings) : settings_(settings)
    {
        Descriptors descriptors;
        const char *error = nullptr;
        if (!enumerate(host_, descriptors, error)) {
            throw std::runtime_error(std::string("enumeration: ") + error);
        }
        check_.expect_start(true);
        next_microframe_ = bridge_.cycles;
    }

    BridgeRun run(uint64_t ticks)
    {
        control(1);
        const uint64_t period = settings_.asked_every;
        bridge_.ask(period, period ? ticks : 0);
        while (period ? !bridge_.all_asked() : run_.packets.size() < ticks) {
            poll();
        }
        control(0);
        while (!check_.ended()) {
            if (period && bridge_.running() && bridge_.all_asked()) { // a tick that a busy link ignored is asked again
                bridge_.ask(std::max(period, MICROFRAME), 1);
            }
            poll();
        }
        return std::move(run_);
    }

  private:
    void control(uint8_t run)
    {
        Bytes report(WHISKER_REPORT_CONTROL_BYTES);
        report[WHISKER_REPORT_CONTROL_ID] = WHISKER_REPORT_ID_CONTROL;
        report[WHISKER_REPORT_CONTROL_WIRE_VERSION] = WHISKER_WIRE_VERSION;
        report[WHISKER_REPORT_CONTROL_RUN] = run;
        report[WHISKER_REPORT_CONTROL_SCK_DIVIDER] = settings_.sck_divider;
        report[WHISKER_REPORT_CONTROL_WORD_GAP] = settings_.word_gap;
        report[WHISKER_REPORT_CONTROL_SAMPLE_POINT] = static_cast<uint8_t>(settings_.sck_divider - 1);
        report[WHISKER_REPORT_CONTROL_OPTIONS] = settings_.options;
        whisker_put_u32(&report[WHISKER_REPORT_CONTROL_LANE_MASK], UINT32_MAX >> (32 - LANES));
        whisker_put_u32(&report[WHISKER_REPORT_CONTROL_TICK_PERIOD], settings_.tick_period);
        const SetupRequest set = {0x21, 9, 0x0300 | WHISKER_REPORT_ID_CONTROL, WHISKER_LIMIT_USB_HID_INTERFACE,
                                  WHISKER_REPORT_CONTROL_BYTES};
        if (control_transfer(host_, set, report) != Outcome::OK) {
            throw std::runtime_error("the bridge did not take the control report");
        }
    }

    void poll()
    {
        while (bridge_.cycles >= next_microframe_) {
            next_microframe_ += MICROFRAME;
            host_.start_of_frame();
            begun_.push_back(bridge_.cycles);
        }
        Bytes packet;
        if (host_.in(WHISKER_LIMIT_USB_BULK_IN & 0xF, WHISKER_LIMIT_BULK_PACKET, packet) == Outcome::OK) {
            note(packet);
        }
    }

    void note(const Bytes &packet)
    {
        const size_t before = run_.packets.size();
        stream_.insert(stream_.end(), packet.begin(), packet.end());
        run_.sizes.push_back(packet.size());
        check_.take(packet);
        for (size_t frame = before; frame < stream_.size() / WHISKER_FRAME_BYTES; frame++) {
            const uint64_t sync = run_.syncs.at(frame);
            run_.packets.push_back(bridge_.cycles - sync);
            run_.last.push_back(run_.sizes.size() - 1);
            run_.dates.push_back(
                whisker_get_u16(&stream_[frame * WHISKER_FRAME_BYTES + WHISKER_FRAME_HEADER_USB_TIME]));
            run_.host.push_back(
                static_cast<uint64_t>(std::upper_bound(begun_.begin(), begun_.end(), sync) - begun_.begin()));
        }
    }

    void count(const CheckedFrame &frame)
    {
        if (frame.tick >= SETTLED) {
            run_.bad += static_cast<uint64_t>(std::count_if(frame.lane.begin(), frame.lane.end(), [](auto &record) {
                return record.status >> WHISKER_STATUS_CODE_SHIFT != WHISKER_CODE_OK;
            }));
        }
    }

    RunSettings settings_;
    BridgeRun run_;
    TickingBridge bridge_{settings_.asked_every == 0, run_.syncs};
    UsbHost host_{bridge_};
    FrameCheck check_{[this](const CheckedFrame &frame) { count(frame); }, settings_.tick_period};
    Bytes stream_;
    std::vector<uint64_t> begun_; // microframes
    uint64_t next_microframe_ = 0;
};

} // namespace

std::vector<uint64_t> BridgeRun::transfers(size_t batch) const
{
    std::vector<size_t> ends(sizes.size()); // by packet: the one that ends its transfer
    size_t first = 0, bytes = 0;
    for (size_t packet = 0; packet < sizes.size(); packet++) {
        bytes += sizes[packet];
        const bool full = bytes >= batch * WHISKER_FRAME_BYTES;
        if (full || sizes[packet] < WHISKER_LIMIT_BULK_PACKET || packet + 1 == sizes.size()) {
            std::fill(ends.begin() + static_cast<std::ptrdiff_t>(first),
                      ends.begin() + static_cast<std::ptrdiff_t>(packet) + 1, packet);
            first = packet + 1;
            bytes = 0;
        }
    }
    std::vector<uint64_t> taken;
    for (size_t frame = 0; frame < packets.size(); frame++) {
        size_t other = frame; // the last frame that the transfer's last packet ends
        while (other + 1 < last.size() && last[other + 1] <= ends[last[frame]]) {
            other++;
        }
        taken.push_back(syncs[other] + packets[other] - syncs[frame]);
    }
    return taken;
}

bool BridgeRun::sustained(uint64_t ticks) const
{
    return packets.size() == ticks && bad == 0;
}

RunSettings RunSettings::fastest()
{
    RunSettings settings;
    settings.sck_divider = WHISKER_LIMIT_SCK_DIVIDER_MIN;
    settings.word_gap = WHISKER_LIMIT_WORD_GAP_MIN;
    return settings;
}

BridgeRun run_bridge(const RunSettings &settings, uint64_t ticks)
{
    return Session(settings).run(ticks);
}

} // namespace bridge_sim
