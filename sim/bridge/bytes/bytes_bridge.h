// Level bytes: the bridge itself as transactions. Settings, runs, ticks, frames, service orders and reports as the
// modules of fpga/bridge_rtl have them, without a clock; what happens within a cycle of each other there happens at
// once here.
#pragma once

#include "bytes_link.h"
#include "bytes_settings.h"
#include "bytes_stream.h"
#include "flash/nor_flash.h"
#include "sampling_state.h"

namespace bridge_sim
{

class BytesBridge
{
  public:
    // As after power came. Bus and flash must outlive the bridge.
    BytesBridge(NodeBus &bus, NorFlash &flash);
    void power_up();

    // A USB bus reset or SET_CONFIGURATION: ends a run, empties everything.
    void halt();

    // A report that the host sets. False: refused, and nothing changed.
    bool set_report(const Bytes &report);

    // A report that the host reads, whole; empty: there is none of this id.
    Bytes get_report(uint8_t id) const;

    bool running() const;            // from start until the last frame is in the FIFO
    uint32_t frames_dropped() const; // since start
    bool every_frame() const;        // each frame ends its packet
    uint32_t tick_period() const;    // cycles

    // A start-of-frame packet comes: the host's eighths of a frame so far.
    void start_of_frame(uint64_t microframe);

    // A tick begins: SYNC. False: none is taken now.
    bool begin_tick();

    // Its transfers, and the frame made of what they brought. Without effect when halt() ended the tick.
    void end_tick();

    // Goes on with a run of plain sampling, whose frames so far have all been taken; and how far it has come.
    void go_on(const LinkSettings &settings, const SamplingState &state);
    SamplingState sampling() const;
    bool drained() const; // all frames have been taken

    // The bulk endpoint: the packet it has ready (null: none), and its acknowledgement.
    const Bytes *packet() const;
    void packet_taken();

  private:
    struct Counters {
        uint32_t ticks, frames, dropped; // since start
        uint32_t sequence;               // since power-up
        uint32_t good, absent, crc, tick;
    };
    using Verdicts = std::array<uint8_t, LANES>;

    bool set_control(const Bytes &report);
    bool set_service(const Bytes &report);
    bool set_flash(const Bytes &report);
    void start();
    void stop();
    Bytes control_report() const;
    Bytes counters_report() const;
    Bytes answers_report() const;
    Bytes timing_report() const;
    Bytes flash_report() const;
    Records window(const Bytes &order, uint32_t expected_tick);
    Verdicts judge(const Records &records, uint32_t tick) const;
    void serve();
    void make_frame(const Records &records, const Verdicts &verdicts);
    Bytes header(bool last) const;
    void count(const Verdicts &verdicts);
    void settle();

    NodeBus &bus_;
    NorFlash &flash_;
    LinkSettings settings_;
    BytesStream stream_;
    Counters counters_{};

    bool run_ = false; // as last written
    bool running_ = false;
    bool stopping_ = false;
    bool finishing_ = false; // the transfer in progress is the run's last
    bool ticked_ = false;    // since start
    bool in_tick_ = false;

    bool first_ = false;  // this tick is number 0
    uint32_t number_ = 0; // of the latest tick
    uint64_t time_ = 0;   // cycles from tick 0 to the latest tick
    uint64_t before_ = 0; // to the one before
    uint16_t usb_frame_ = 0;
    uint8_t usb_microframe_ = 0;
    bool usb_known_ = false;       // there was a start-of-frame packet
    uint16_t usb_time_ = 0;        // of the latest tick
    uint16_t usb_time_before_ = 0; // of the one before
    bool service_ = false;         // this tick has a second window
    bool pattern_ = false;         // and the bridge's own records

    uint8_t flash_command_ = 0; // of the latest order
    Bytes flash_body_;          // address and data, as the report has them; they outlive a loss of power

    Bytes order_; // service order that waits; empty: none
    uint8_t windows_ = 0;
    uint8_t asked_tick_ = 0; // of the service order before: its answers carry it
    Records answers_{};
    Verdicts answer_verdicts_{};
    Verdicts kept_verdicts_{}; // of a last frame that waits for room
};

} // namespace bridge_sim
