#include "paced_bridge.h"

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

class PacedRun
{
  public:
    explicit PacedRun(uint64_t rest) : rest_(rest)
    {
        Descriptors descriptors;
        const char *error = nullptr;
        if (!enumerate(host_, descriptors, error)) {
            throw std::runtime_error(std::string("enumeration: ") + error);
        }
        check_.expect_start(true);
    }

    PaceResult run(uint64_t period, uint64_t ticks)
    {
        control(1);
        const uint64_t began = bridge_.cycles;
        const uint64_t naks = host_.counters().naks;
        bridge_.pace(period, ticks);
        while (!bridge_.all_asked()) {
            read();
        }
        result_.cycles = bridge_.cycles - began;
        result_.naks = host_.counters().naks - naks;
        stop(period);
        result_.asked = ticks;
        result_.frames = check_.frames();
        return result_;
    }

  private:
    void control(uint8_t run)
    {
        Bytes report = {WHISKER_REPORT_ID_CONTROL,     WHISKER_WIRE_VERSION,       run,
                        WHISKER_LIMIT_SCK_DIVIDER_MIN, WHISKER_LIMIT_WORD_GAP_MIN, WHISKER_LIMIT_SCK_DIVIDER_MIN - 1};
        report.resize(WHISKER_REPORT_CONTROL_BYTES);
        whisker_put_u32(&report[WHISKER_REPORT_CONTROL_LANE_MASK], UINT32_MAX >> (32 - LANES));
        whisker_put_u32(&report[WHISKER_REPORT_CONTROL_TICK_PERIOD], WHISKER_LIMIT_TICK_PERIOD);
        const SetupRequest set = {0x21, 9, 0x0300 | WHISKER_REPORT_ID_CONTROL, WHISKER_LIMIT_USB_HID_INTERFACE,
                                  WHISKER_REPORT_CONTROL_BYTES};
        if (control_transfer(host_, set, report) != Outcome::OK) {
            throw std::runtime_error("the bridge did not take the control report");
        }
    }

    // A tick that a busy link ignores leaves the run open: it is asked for again.
    void stop(uint64_t period)
    {
        control(0);
        while (bridge_.running()) {
            if (bridge_.all_asked()) {
                bridge_.pace(std::max(period, MICROFRAME), 1);
            }
            read();
        }
        while (!check_.ended()) {
            read();
        }
    }

    void read()
    {
        if (bridge_.cycles >= next_microframe_) {
            next_microframe_ = bridge_.cycles + MICROFRAME;
            host_.start_of_frame();
        }
        if (host_.in(WHISKER_LIMIT_USB_BULK_IN & 0xF, WHISKER_LIMIT_BULK_PACKET, packet_) == Outcome::OK) {
            check_.take(packet_);
        }
        host_.idle(rest_);
    }

    void count(const CheckedFrame &frame)
    {
        if (frame.tick >= SETTLED) {
            result_.bad += static_cast<uint64_t>(std::count_if(frame.lane.begin(), frame.lane.end(), [](auto &record) {
                return record.status >> WHISKER_STATUS_CODE_SHIFT != WHISKER_CODE_OK;
            }));
        }
    }

    PacedBridge bridge_{SEED};
    UsbHost host_{bridge_};
    FrameCheck check_{[this](const CheckedFrame &frame) { count(frame); }};
    PaceResult result_;
    Bytes packet_;
    uint64_t rest_;
    uint64_t next_microframe_ = 0;
};

} // namespace

PacedBridge::PacedBridge(uint64_t seed) : nodes_(LANES, seed), bridge_(nodes_, flash_)
{
    nodes_.power_on();
}

void PacedBridge::pace(uint64_t period, uint64_t ticks)
{
    period_ = period;
    left_ = ticks;
    wait_ = 0;
}

bool PacedBridge::all_asked() const
{
    return left_ == 0;
}

bool PacedBridge::running() const
{
    return bridge_.running();
}

void PacedBridge::cycle()
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
    if (ended_) {
        nodes_.run();
    }
    ended_ = busy_ && !bridge_.link_busy();
    busy_ = bridge_.link_busy();
    out = bridge_.out;
    cycles++;
}

bool PaceResult::sustained() const
{
    return frames == asked && bad == 0;
}

PaceResult run_paced(uint64_t period, uint64_t ticks, uint64_t rest)
{
    return PacedRun(rest).run(period, ticks);
}

} // namespace bridge_sim
