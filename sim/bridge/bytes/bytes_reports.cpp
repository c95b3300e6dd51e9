// Level bytes: the HID reports, as control_registers.v, service_store.v, flash_control.v, report_reader.v and
// answer_store.v have them. An order to the flash is carried out at once.
#include "bytes_bridge.h"

#include <algorithm>

namespace bridge_sim
{

namespace
{

constexpr size_t FLASH_UNIT = WHISKER_REPORT_FLASH_BYTES - WHISKER_REPORT_FLASH_DATA;

bool is_report(const Bytes &report, uint8_t id, size_t size)
{
    return report.size() == size && report[0] == id &&
           report[WHISKER_REPORT_CONTROL_WIRE_VERSION] == WHISKER_WIRE_VERSION;
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
    report[WHISKER_REPORT_IDENTITY_BOARD] = WHISKER_BOARD_SIMULATION;
    report[WHISKER_REPORT_IDENTITY_WIRED_LANES] = WHISKER_LIMIT_LANES;
    return report;
}

} // namespace

bool BytesBridge::set_report(const Bytes &report)
{
    return set_control(report) || set_service(report) || set_flash(report);
}

bool BytesBridge::set_control(const Bytes &report)
{
    if (!is_report(report, WHISKER_REPORT_ID_CONTROL, WHISKER_REPORT_CONTROL_BYTES)) {
        return false;
    }
    const uint8_t run = report[WHISKER_REPORT_CONTROL_RUN];
    const LinkSettings settings = LinkSettings::of_report(report);
    const bool reserved = report[WHISKER_REPORT_CONTROL_OPTIONS + 1] != 0;
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

// The body is gathered before the order is judged, and stays if it is refused.
bool BytesBridge::set_flash(const Bytes &report)
{
    if (report[0] != WHISKER_REPORT_ID_FLASH) {
        return false;
    }
    const size_t body = std::min<size_t>(report.size(), WHISKER_REPORT_FLASH_BYTES) - WHISKER_REPORT_FLASH_ADDRESS;
    std::copy_n(report.begin() + WHISKER_REPORT_FLASH_ADDRESS, body, flash_body_.begin());
    const uint32_t address = whisker_get_u32(report.data() + WHISKER_REPORT_FLASH_ADDRESS);
    const uint8_t command = report[WHISKER_REPORT_FLASH_COMMAND];
    const bool writes = command == WHISKER_FLASH_COMMAND_ERASE || command == WHISKER_FLASH_COMMAND_PROGRAM;
    const uint32_t end = writes ? uint32_t{NorFlash::WRITABLE_SECTORS} << 16 : 1u << 24;
    if (!is_report(report, WHISKER_REPORT_ID_FLASH, WHISKER_REPORT_FLASH_BYTES) || running_ ||
        command > WHISKER_FLASH_COMMAND_PROGRAM || address >= end || address % FLASH_UNIT != 0) {
        return false;
    }
    flash_command_ = command;
    const auto data = flash_body_.begin() + WHISKER_REPORT_FLASH_DATA - WHISKER_REPORT_FLASH_ADDRESS;
    if (command == WHISKER_FLASH_COMMAND_ERASE) {
        flash_.erase(address);
    } else if (command == WHISKER_FLASH_COMMAND_PROGRAM) {
        flash_.program(address, {data, flash_body_.end()});
    } else {
        const bool reads = command == WHISKER_FLASH_COMMAND_READ;
        const Bytes found = reads ? flash_.read(address, FLASH_UNIT) : flash_.identify();
        std::copy(found.begin(), found.end(), data);
    }
    return true;
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
    case WHISKER_REPORT_ID_TIMING:
        return timing_report();
    case WHISKER_REPORT_ID_FLASH:
        return flash_report();
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

// Ticks are the simulation's own, not the pin's, and come with their start-of-frame packet.
Bytes BytesBridge::timing_report() const
{
    Bytes report = empty_report(WHISKER_REPORT_ID_TIMING, WHISKER_REPORT_TIMING_BYTES);
    whisker_put_u16(&report[WHISKER_REPORT_TIMING_USB_TIME], usb_time_);
    whisker_put_u32(&report[WHISKER_REPORT_TIMING_TICK], number_);
    whisker_put_u32(&report[WHISKER_REPORT_TIMING_SHORTEST], UINT32_MAX);
    return report;
}

Bytes BytesBridge::flash_report() const
{
    Bytes report = empty_report(WHISKER_REPORT_ID_FLASH, WHISKER_REPORT_FLASH_BYTES);
    report[WHISKER_REPORT_FLASH_COMMAND] = flash_command_;
    report[WHISKER_REPORT_FLASH_WRITABLE + 2] = NorFlash::WRITABLE_SECTORS;
    std::copy(flash_body_.begin(), flash_body_.end(), report.begin() + WHISKER_REPORT_FLASH_ADDRESS);
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
