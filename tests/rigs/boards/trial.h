// A board tried as a user would: enumeration, a run, every lane's record in its place, an order to every node, the
// LEDs.
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>

#include "board.h"
#include "board_fault.h"
#include "frame_check.h"
#include "node_bus.h"
#include "usb_control.h"

namespace bridge_sim
{

constexpr uint64_t PATIENCE = 8 * WHISKER_LIMIT_TICK_PERIOD; // cycles without a frame
constexpr uint64_t LED_DELAY = 200;
constexpr uint8_t BULK = WHISKER_LIMIT_USB_BULK_IN & 0xF;
constexpr size_t FULL_SPEED_PACKET = 64;

struct Kind {
    const char *name;
    BusSpeed speed;
    bool polarity; // its PHY needs a register written
    bool leds;     // the bench sees them
    std::function<std::unique_ptr<Board>(NodeBus &, const BoardFault &)> make;
};
class Trial
{
  public:
    Trial(const Kind &kind, const BoardFault &fault)
        : speed_(kind.speed), leds_(kind.leds), board_(kind.make(nodes_, fault))
    {
        nodes_.power_on();
        for (size_t lane = 0; lane < LANES; lane++) {
            fields_[lane] = {static_cast<double>(lane) - 14.0, 7.0 - 0.5 * static_cast<double>(lane)};
        }
        nodes_.set_fields(fields_.data());
    }
    Board &board()
    {
        return *board_;
    }
    UsbHost &host()
    {
        return host_;
    }
    void enumerated()
    {
        Descriptors descriptors;
        const char *error = nullptr;
        const auto transfer = [this](const SetupRequest &request, Bytes &data) {
            return control_transfer(host_, request, data);
        };
        require(host_.reset(speed_), "no device after a reset");
        shows(LED_PHY);
        if (!configure(transfer, descriptors, error)) {
            throw std::runtime_error(error);
        }
    }
    void begin(uint32_t tick_period = WHISKER_LIMIT_TICK_PERIOD)
    {
        check_.expect_start(true);
        control(1, tick_period);
    }
    void end()
    {
        control(0);
    }
    // What the LEDs show; they follow within some cycles of the oscillator.
    void shows(uint8_t leds)
    {
        host_.idle(LED_DELAY);
        require(!leds_ || board_->leds() == leds, "the LEDs show something else");
    }
    // A run, begun and ended; throws std::runtime_error with what is wrong.
    void runs(uint64_t ticks)
    {
        require(board_->bus_is_idle(), "the nodes' lines are not idle before a run");
        shows(LED_PHY | LED_CONFIGURED);
        begin();
        while (check_.frames() < ticks) {
            read();
        }
        shows(LED_PHY | LED_CONFIGURED | LED_RUN);
        hears_orders();
        end();
        while (!check_.ended()) {
            read();
        }
        shows(LED_PHY | LED_CONFIGURED);
        require(host_.counters().unexplained == 0, "transactions went wrong");
    }

  private:
    static void require(bool ok, const char *what)
    {
        if (!ok) {
            throw std::runtime_error(what);
        }
    }
    void set_report(Bytes report, uint16_t size)
    {
        report.resize(size);
        const auto value = static_cast<uint16_t>(0x0300 | report[0]);
        require(control_transfer(host_, {0x21, 9, value, WHISKER_LIMIT_USB_HID_INTERFACE, size}, report) == Outcome::OK,
                "a report is not taken");
        limit_ = board_->cycles + PATIENCE;
    }
    void control(uint8_t run, uint32_t tick_period = WHISKER_LIMIT_TICK_PERIOD)
    {
        Bytes report = {WHISKER_REPORT_ID_CONTROL, WHISKER_WIRE_VERSION, run, 6, 30, 3};
        report.resize(WHISKER_REPORT_CONTROL_BYTES);
        whisker_put_u32(&report[WHISKER_REPORT_CONTROL_LANE_MASK], UINT32_MAX >> (32 - LANES));
        whisker_put_u32(&report[WHISKER_REPORT_CONTROL_TICK_PERIOD], tick_period);
        set_report(report, WHISKER_REPORT_CONTROL_BYTES);
    }
    // Each node reports its serial number, and the order reached it by MOSI alone.
    void hears_orders()
    {
        for (const uint8_t command : {WHISKER_SERVICE_COMMAND_INFO, WHISKER_SERVICE_COMMAND_POLL}) {
            set_report({WHISKER_REPORT_ID_SERVICE, WHISKER_WIRE_VERSION, command, WHISKER_INFO_SERIAL},
                       WHISKER_REPORT_SERVICE_BYTES);
            for (const uint64_t until = check_.frames() + 2; check_.frames() < until;) {
                read();
            }
        }
        Bytes answers;
        require(control_transfer(host_,
                                 {0xA1, 1, 0x0300 | WHISKER_REPORT_ID_ANSWERS, WHISKER_LIMIT_USB_HID_INTERFACE,
                                  WHISKER_REPORT_ANSWERS_BYTES},
                                 answers) == Outcome::OK,
                "the answers cannot be read");
        for (size_t lane = 0; lane < LANES; lane++) {
            const uint8_t *answer = &answers.at(WHISKER_REPORT_ANSWERS_ANSWER + 6 * lane);
            require(whisker_get_u16(answer) == lane + 1 &&
                        whisker_get_u16(answer + 4) >> WHISKER_STATUS_CODE_SHIFT == WHISKER_CODE_ANSWER,
                    "a node does not hear orders");
        }
    }
    void read()
    {
        const size_t packet = speed_ == BusSpeed::HIGH ? WHISKER_LIMIT_BULK_PACKET : FULL_SPEED_PACKET;
        if (host_.in(BULK, packet, packet_) == Outcome::OK) {
            check_.take(packet_);
        }
        host_.idle(packet);
        require(board_->cycles < limit_, "frames do not come");
    }
    void judge(const CheckedFrame &frame)
    {
        limit_ = board_->cycles + PATIENCE;
        for (size_t lane = 0; lane < LANES; lane++) {
            const CheckedRecord &record = frame.lane[lane];
            require(record.status == 0 && record.alpha == sim_counts(fields_[lane].alpha_deg) &&
                        record.beta == sim_counts(fields_[lane].beta_deg),
                    "a record is not its lane's reading");
        }
    }

    NodeBus nodes_{LANES, 1};
    std::array<sim_field, LANES> fields_{};
    BusSpeed speed_;
    bool leds_;
    std::unique_ptr<Board> board_;
    UsbHost host_{*board_};
    FrameCheck check_{[this](const CheckedFrame &frame) { judge(frame); }};
    Bytes packet_;
    uint64_t limit_ = 0;
};

// What a user would see go wrong; empty: nothing.
inline std::string tried(const Kind &kind, const BoardFault &fault, uint64_t ticks)
{
    try {
        Trial trial(kind, fault);
        trial.enumerated();
        trial.runs(ticks);
    } catch (const std::runtime_error &error) {
        return error.what();
    }
    return "";
}

} // namespace bridge_sim
