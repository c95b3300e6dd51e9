#include "bench.h"
#include "make_rig.h"

#include <cerrno>
#include <chrono>
#include <cmath>
#include <map>
#include <set>
#include <stdexcept>

namespace bridge_sim
{

namespace
{

constexpr size_t TRANSFERS = 4;
constexpr size_t TRANSFER_BYTES = 4096;
constexpr double FIELD_RANGE_DEG = 60;
constexpr double FIELD_STEP_DEG = 25.0; // a node does not believe more than 30 in a tick
constexpr uint8_t HID_SET_REPORT_TYPE = 0x21;
constexpr uint8_t HID_SET_REPORT = 0x09;
constexpr uint16_t HID_FEATURE = 0x0300;
constexpr uint32_t ALL_LANES = UINT32_MAX >> (32 - LANES);

// How each kind of fault must be reported. A flipped bit of a sensor frame is in its start byte or spoils its sum.
const std::map<std::string, std::set<unsigned>> CODES_OF_KINDS = {
    {"sensor_flip", {WHISKER_CODE_SENSOR_SUM, WHISKER_CODE_SENSOR_START}},
    {"sensor_dead", {WHISKER_CODE_SENSOR_ABSENT}},
    {"sensor_low", {WHISKER_CODE_SENSOR_START}},
    {"sensor_error", {WHISKER_CODE_OK}},
    {"resync", {WHISKER_CODE_RESYNC}},
    {"link_flip", {WHISKER_CODE_LINK_CRC}},
    {"link_dead", {WHISKER_CODE_ABSENT}},
    {"link_stale", {WHISKER_CODE_LINK_TICK}},
};

Bytes control_report(const BenchSettings &settings, uint8_t run)
{
    Bytes report(WHISKER_REPORT_CONTROL_BYTES);
    report[WHISKER_REPORT_CONTROL_ID] = WHISKER_REPORT_ID_CONTROL;
    report[WHISKER_REPORT_CONTROL_WIRE_VERSION] = WHISKER_WIRE_VERSION;
    report[WHISKER_REPORT_CONTROL_RUN] = run;
    report[WHISKER_REPORT_CONTROL_SCK_DIVIDER] = settings.sck_divider;
    report[WHISKER_REPORT_CONTROL_WORD_GAP] = settings.word_gap;
    report[WHISKER_REPORT_CONTROL_SAMPLE_POINT] = settings.sample_point;
    whisker_put_u32(report.data() + WHISKER_REPORT_CONTROL_LANE_MASK, ALL_LANES);
    whisker_put_u32(report.data() + WHISKER_REPORT_CONTROL_TICK_PERIOD, WHISKER_LIMIT_TICK_PERIOD);
    return report;
}

std::optional<FaultPlan> plan_of(const BenchSettings &settings)
{
    if (!settings.faults) {
        return std::nullopt;
    }
    return FaultPlan(settings.seed, settings.populated, settings.ticks);
}

double now_s()
{
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

std::string at(size_t lane, uint64_t tick)
{
    return "lane " + std::to_string(lane) + ", tick " + std::to_string(tick) + ": ";
}

} // namespace

Bench::Bench(const BenchSettings &settings)
    : settings_(settings), rig_(make_rig(settings.level, settings.populated, settings.seed, {}, settings.rtl_ticks)),
      scheduler_(*rig_), log_(settings.lane_fault_path, settings.usb_fault_path),
      runner_(*rig_, scheduler_, plan_of(settings), log_),
      check_([this](const CheckedFrame &frame) { check_frame(frame); }), generator_(settings.seed)
{
}

uint64_t Bench::frames_of_run() const
{
    return check_.frames();
}

void Bench::check_usb() const
{
    runner_.check_usb();
}

const FaultLog &Bench::faults() const
{
    return log_;
}

void Bench::power_on()
{
    Descriptors descriptors;
    const char *error = nullptr;
    if (!rig_->power_on(descriptors, error)) {
        throw std::runtime_error(std::string("enumeration: ") + error);
    }
}

BenchResult Bench::run()
{
    power_on();
    const uint64_t cycles = rig_->cycles();
    const double begin_s = now_s();
    start();
    ticks(settings_.ticks);
    stop();
    const double wall_s = now_s() - begin_s;
    check_usb();
    check_faults();
    log_.close();
    return {settings_.ticks, frames_of_run(), rig_->cycles() - cycles, wall_s};
}

// ---------------------------------------------------------------------------------------------------------------- USB

void Bench::send(uint8_t run)
{
    const Bytes report = control_report(settings_, run);
    Urb urb;
    urb.setup = {HID_SET_REPORT_TYPE, HID_SET_REPORT, HID_FEATURE | WHISKER_REPORT_ID_CONTROL,
                 WHISKER_LIMIT_USB_HID_INTERFACE, WHISKER_REPORT_CONTROL_BYTES};
    urb.data = report;
    scheduler_.submit(std::move(urb));
    scheduler_.step();
    take_transfers();
    if (rig_->running() != (run != 0) && !scheduler_.stop_seen()) {
        throw std::runtime_error("the bridge did not take the control report");
    }
}

void Bench::submit_transfer()
{
    Urb urb;
    urb.kind = UrbKind::BULK_IN;
    submitted_++;
    urb.length = TRANSFER_BYTES;
    scheduler_.submit(std::move(urb));
}

void Bench::take_transfers()
{
    for (const Urb &urb : scheduler_.take_completed()) {
        submitted_ -= urb.kind == UrbKind::BULK_IN ? 1 : 0;
        if (urb.status == -ESHUTDOWN) {
            check_.take(urb.data); // received before the bus reset
            continue;
        }
        if (urb.status != 0) {
            throw std::runtime_error("a USB transfer ended with errno " + std::to_string(-urb.status));
        }
        if (urb.kind == UrbKind::BULK_IN) {
            check_.take(urb.data);
            submit_transfer();
        }
    }
}

void Bench::wait_until_ready()
{
    while (!runner_.ready()) {
        scheduler_.step();
        take_transfers();
    }
}

// ---------------------------------------------------------------------------------------------------------------- run

void Bench::start()
{
    tick_ = 0;
    sent_.clear();
    check_.expect_start(reset_);
    reset_ = false;
    while (submitted_ < TRANSFERS) {
        submit_transfer();
    }
    send(1);
}

void Bench::ticks(uint64_t count)
{
    for (uint64_t i = 0; i < count; i++) {
        wait_until_ready();
        draw_fields();
        runner_.tick(tick_++, fields_.data());
        take_transfers();
    }
}

void Bench::stop()
{
    send(0);
    runner_.last_tick(fields_.data());
    while (rig_->bulk_packet_due()) {
        scheduler_.step();
    }
    take_transfers();
    if (!check_.ended() || sent_.size() != tick_) {
        throw std::runtime_error("the last frame did not come");
    }
}

void Bench::enumerate_again()
{
    Urb urb;
    urb.kind = UrbKind::BUS_RESET;
    reset_ = true;
    scheduler_.submit(std::move(urb));
    scheduler_.step();
    take_transfers();
}

// Every lane its own angles, so that lanes, axes and bytes cannot be mistaken for each other.
void Bench::draw_fields()
{
    const auto wander = [this](double &angle) {
        angle += FIELD_STEP_DEG * (2.0 * static_cast<double>(generator_() >> 11) * 0x1.0p-53 - 1.0);
        if (std::abs(angle) > FIELD_RANGE_DEG)
            angle = std::copysign(2.0 * FIELD_RANGE_DEG, angle) - angle;
    };
    for (sim_field &field : fields_) {
        wander(field.alpha_deg);
        wander(field.beta_deg);
    }
    sent_.push_back(fields_);
}

// ---------------------------------------------------------------------------------------------------------------
// checks

void Bench::check_frame(const CheckedFrame &frame)
{
    for (size_t lane = 0; lane < LANES; lane++) {
        check_lane(frame, lane);
    }
}

void Bench::check_lane(const CheckedFrame &frame, size_t lane)
{
    const CheckedRecord &record = frame.lane[lane];
    const bool absent = record.status == WHISKER_CODE_ABSENT << WHISKER_STATUS_CODE_SHIFT;
    if (lane >= settings_.populated) {
        if (!absent) {
            throw std::runtime_error(at(lane, frame.tick) + "nobody is there, but the record does not say absent");
        }
        return;
    }
    if (record.status != 0) {
        reported_[{lane, frame.tick}] = record.status;
        return;
    }
    const sim_field &field = sent_.at(frame.tick)[lane];
    if (record.alpha != sim_counts(field.alpha_deg) || record.beta != sim_counts(field.beta_deg)) {
        throw std::runtime_error(at(lane, frame.tick) + "the counts are not those of the field");
    }
}

void Bench::check_faults() const
{
    for (const auto &[pair, status] : reported_) {
        const auto fault = log_.pairs().find(pair);
        if (fault == log_.pairs().end()) {
            throw std::runtime_error(at(pair.first, pair.second) + "reported bad, but nothing was injected");
        }
        if (CODES_OF_KINDS.at(fault->second).count(status >> WHISKER_STATUS_CODE_SHIFT) == 0) {
            throw std::runtime_error(at(pair.first, pair.second) + fault->second + " was reported with a wrong code");
        }
    }
    for (const auto &[pair, kind] : log_.pairs()) {
        if (reported_.count(pair) == 0) {
            throw std::runtime_error(at(pair.first, pair.second) + kind + " was injected, but not reported");
        }
    }
}

} // namespace bridge_sim
