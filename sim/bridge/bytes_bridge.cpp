#include "bytes_bridge.h"

#include <algorithm>

namespace bridge_sim
{

namespace
{

bool is_report(const Bytes &report, uint8_t id, size_t size)
{
    return report.size() == size && report[0] == id &&
           report[WHISKER_REPORT_CONTROL_WIRE_VERSION] == WHISKER_WIRE_VERSION;
}

// In place of a record or an answer that was not accepted: the code alone, in the status's upper byte.
constexpr uint8_t upper(uint8_t code)
{
    return static_cast<uint8_t>(code << (WHISKER_STATUS_CODE_SHIFT - 8));
}

Bytes empty_report(uint8_t id, size_t size)
{
    Bytes report(size);
    report[0] = id;
    report[WHISKER_REPORT_CONTROL_WIRE_VERSION] = WHISKER_WIRE_VERSION; // at the same place in every report
    return report;
}

Bytes identity_report()
{
    Bytes report = empty_report(WHISKER_REPORT_ID_IDENTITY, WHISKER_REPORT_IDENTITY_BYTES);
    report[WHISKER_REPORT_IDENTITY_LANES] = WHISKER_LIMIT_LANES;
    report[WHISKER_REPORT_IDENTITY_GATEWARE] = WHISKER_LIMIT_GATEWARE_VERSION;
    whisker_put_u32(&report[WHISKER_REPORT_IDENTITY_CLOCK_HZ], WHISKER_LIMIT_CLOCK_HZ);
    whisker_put_u16(&report[WHISKER_REPORT_IDENTITY_FRAME_BYTES], WHISKER_FRAME_BYTES);
    whisker_put_u16(&report[WHISKER_REPORT_IDENTITY_FIFO_BYTES], WHISKER_LIMIT_FIFO_BYTES);
    return report;
}

Record error_record(uint8_t tick, uint8_t code)
{
    Record record{};
    record[WHISKER_RECORD_TICK] = tick;
    record[WHISKER_RECORD_STATUS + 1] = upper(code);
    record[WHISKER_RECORD_CRC] = whisker_crc8(record.data(), WHISKER_RECORD_CRC);
    return record;
}

} // namespace

BytesBridge::BytesBridge(NodeBus &bus) : bus_(bus)
{
    power_up();
}

// The tick of the service order before outlives it, as its register has no reset.
void BytesBridge::power_up()
{
    settings_ = LinkSettings();
    counters_ = Counters();
    windows_ = 0;
    halt();
}

void BytesBridge::halt()
{
    stream_.clear();
    run_ = running_ = stopping_ = finishing_ = ticked_ = in_tick_ = false;
    order_.clear();
    answer_verdicts_.fill(WHISKER_CODE_ABSENT);
}

bool BytesBridge::running() const
{
    return running_;
}

// ------------------------------------------------------------------------------------------------------------ ticks

bool BytesBridge::begin_tick()
{
    if (!running_ || finishing_ || (stopping_ && !ticked_)) {
        return false;
    }
    first_ = !ticked_;
    number_ = first_ ? 0 : number_ + 1;
    before_ = time_;
    time_ = first_ ? 0 : time_ + settings_.tick_period;
    finishing_ = stopping_;
    ticked_ = in_tick_ = true;
    service_ = !order_.empty() && settings_.service_fits();
    counters_.ticks++;
    link_sync(bus_);
    return true;
}

void BytesBridge::end_tick()
{
    if (!in_tick_) {
        return;
    }
    const Records records = link_window(bus_, sample_order(static_cast<uint8_t>(number_), service_));
    if (!first_) {
        make_frame(records, judge(records, number_ - 1));
    }
    if (service_) {
        serve();
    }
    in_tick_ = false;
    settle();
}

BytesBridge::Verdicts BytesBridge::judge(const Records &records, uint32_t tick) const
{
    Verdicts verdicts{};
    for (size_t lane = 0; lane < LANES; lane++) {
        const bool used = settings_.lane_mask >> lane & 1u;
        verdicts[lane] = used ? link_verdict(records[lane], static_cast<uint8_t>(tick)) : WHISKER_CODE_LANE_OFF;
    }
    return verdicts;
}

void BytesBridge::serve()
{
    answers_ = link_window(bus_, service_order(static_cast<uint8_t>(number_), order_));
    answer_verdicts_ = judge(answers_, asked_tick_);
    asked_tick_ = static_cast<uint8_t>(number_);
    windows_++;
    order_.clear();
}

// ----------------------------------------------------------------------------------------------------------- frames

Bytes BytesBridge::header(bool last) const
{
    Bytes bytes(WHISKER_FRAME_HEADER_BYTES);
    whisker_put_u16(&bytes[WHISKER_FRAME_HEADER_MAGIC], WHISKER_LIMIT_FRAME_MAGIC);
    bytes[WHISKER_FRAME_HEADER_WIRE_VERSION] = WHISKER_WIRE_VERSION;
    bytes[WHISKER_FRAME_HEADER_FLAGS] = last ? WHISKER_FRAME_FLAG_LAST : 0;
    whisker_put_u32(&bytes[WHISKER_FRAME_HEADER_TICK], number_ - 1);
    whisker_put_u32(&bytes[WHISKER_FRAME_HEADER_TIME], static_cast<uint32_t>(before_));
    whisker_put_u32(&bytes[WHISKER_FRAME_HEADER_TIME + 4], static_cast<uint32_t>(before_ >> 32));
    whisker_put_u32(&bytes[WHISKER_FRAME_HEADER_SEQUENCE], counters_.sequence);
    whisker_put_u32(&bytes[WHISKER_FRAME_HEADER_DROPPED], counters_.dropped);
    whisker_put_u32(&bytes[WHISKER_FRAME_HEADER_LANE_MASK], settings_.lane_mask);
    bytes[WHISKER_FRAME_HEADER_LANES] = WHISKER_LIMIT_LANES;
    bytes[WHISKER_FRAME_HEADER_CRC] = whisker_crc8(bytes.data(), WHISKER_FRAME_HEADER_CRC);
    return bytes;
}

void BytesBridge::make_frame(const Records &records, const Verdicts &verdicts)
{
    Bytes frame = header(finishing_);
    for (size_t lane = 0; lane < LANES; lane++) {
        const Record record = verdicts[lane] == WHISKER_CODE_OK
                                  ? records[lane]
                                  : error_record(static_cast<uint8_t>(number_ - 1), verdicts[lane]);
        frame.insert(frame.end(), record.begin(), record.end());
    }
    counters_.frames++;
    counters_.sequence++;
    counters_.dropped += stream_.push(frame, finishing_) ? 0 : 1;
    if (stream_.waiting()) {
        kept_verdicts_ = verdicts; // the framer stands still at its first byte
    } else {
        count(verdicts);
    }
}

void BytesBridge::count(const Verdicts &verdicts)
{
    const auto of = [&verdicts](uint8_t code) {
        return static_cast<uint32_t>(std::count(verdicts.begin(), verdicts.end(), code));
    };
    counters_.good += of(WHISKER_CODE_OK);
    counters_.absent += of(WHISKER_CODE_ABSENT);
    counters_.crc += of(WHISKER_CODE_LINK_CRC);
    counters_.tick += of(WHISKER_CODE_LINK_TICK);
}

// The run is over when its last frame is in the FIFO.
void BytesBridge::settle()
{
    if (finishing_ && !in_tick_ && !stream_.waiting()) {
        running_ = stopping_ = finishing_ = ticked_ = false;
    }
}

const Bytes *BytesBridge::packet() const
{
    return stream_.packet();
}

void BytesBridge::packet_taken()
{
    const bool waited = stream_.waiting();
    stream_.packet_taken();
    if (waited && !stream_.waiting()) {
        count(kept_verdicts_);
    }
    settle();
}

// ---------------------------------------------------------------------------------------------------------- reports

bool BytesBridge::set_report(const Bytes &report)
{
    return set_control(report) || set_service(report);
}

bool BytesBridge::set_control(const Bytes &report)
{
    if (!is_report(report, WHISKER_REPORT_ID_CONTROL, WHISKER_REPORT_CONTROL_BYTES)) {
        return false;
    }
    const uint8_t run = report[WHISKER_REPORT_CONTROL_RUN];
    const LinkSettings settings = LinkSettings::of_report(report);
    const bool reserved = std::any_of(report.begin() + WHISKER_REPORT_CONTROL_SAMPLE_POINT + 1,
                                      report.begin() + WHISKER_REPORT_CONTROL_LANE_MASK, [](uint8_t b) { return b; });
    if (run > 1 || (run == 1 && stopping_) || reserved || !settings.valid()) {
        return false;
    }
    settings_ = settings;
    if (run && !run_) {
        start();
    } else if (!run && run_) {
        stop();
    }
    run_ = run;
    return true;
}

void BytesBridge::start()
{
    running_ = true;
    counters_.ticks = counters_.frames = counters_.dropped = 0;
}

// Before the first tick there is nothing to wait for.
void BytesBridge::stop()
{
    running_ = stopping_ = ticked_;
}

bool BytesBridge::set_service(const Bytes &report)
{
    const bool right = is_report(report, WHISKER_REPORT_ID_SERVICE, WHISKER_REPORT_SERVICE_BYTES) &&
                       settings_.service_fits() && order_.empty();
    if (right) {
        order_ = report;
    }
    return right;
}

Bytes BytesBridge::get_report(uint8_t id) const
{
    switch (id) {
    case WHISKER_REPORT_ID_CONTROL:
        return control_report();
    case WHISKER_REPORT_ID_COUNTERS:
        return counters_report();
    case WHISKER_REPORT_ID_IDENTITY:
        return identity_report();
    case WHISKER_REPORT_ID_ANSWERS:
        return answers_report();
    default:
        return {};
    }
}

Bytes BytesBridge::control_report() const
{
    Bytes report = empty_report(WHISKER_REPORT_ID_CONTROL, WHISKER_REPORT_CONTROL_BYTES);
    report[WHISKER_REPORT_CONTROL_RUN] = run_;
    settings_.put(report);
    return report;
}

Bytes BytesBridge::counters_report() const
{
    Bytes report = empty_report(WHISKER_REPORT_ID_COUNTERS, WHISKER_REPORT_COUNTERS_BYTES);
    report[WHISKER_REPORT_COUNTERS_RUNNING] = running_;
    whisker_put_u32(&report[WHISKER_REPORT_COUNTERS_TICKS], counters_.ticks);
    whisker_put_u32(&report[WHISKER_REPORT_COUNTERS_FRAMES], counters_.frames);
    whisker_put_u32(&report[WHISKER_REPORT_COUNTERS_DROPPED], counters_.dropped);
    whisker_put_u32(&report[WHISKER_REPORT_COUNTERS_RECORDS_GOOD], counters_.good);
    whisker_put_u32(&report[WHISKER_REPORT_COUNTERS_RECORDS_ABSENT], counters_.absent);
    whisker_put_u32(&report[WHISKER_REPORT_COUNTERS_RECORDS_CRC], counters_.crc);
    whisker_put_u32(&report[WHISKER_REPORT_COUNTERS_RECORDS_TICK], counters_.tick);
    return report;
}

Bytes BytesBridge::answers_report() const
{
    Bytes report = empty_report(WHISKER_REPORT_ID_ANSWERS, WHISKER_REPORT_ANSWERS_ANSWER);
    report[WHISKER_REPORT_ANSWERS_PENDING] = !order_.empty();
    report[WHISKER_REPORT_ANSWERS_SEQUENCE] = windows_;
    for (size_t lane = 0; lane < LANES; lane++) {
        const uint8_t verdict = answer_verdicts_[lane];
        const Record record = verdict == WHISKER_CODE_OK ? answers_[lane] : error_record(0, verdict);
        report.insert(report.end(), record.begin() + WHISKER_RECORD_ALPHA, record.begin() + WHISKER_RECORD_CRC);
    }
    return report;
}

} // namespace bridge_sim
