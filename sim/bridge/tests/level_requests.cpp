#include "level_requests.h"

namespace bridge_sim
{

namespace
{

constexpr uint8_t GET_TYPE = 0xA1, SET_REPORT = 9, GET_REPORT = 1;
constexpr uint32_t ALL_LANES = UINT32_MAX >> (32 - LANES);
constexpr uint16_t REPORT_LENGTHS[] = {0, 1, 16, 64, 100, 176, 255};

HostRequest set_report(Bytes report)
{
    HostRequest request;
    request.setup = {SET_REPORT_TYPE, SET_REPORT, static_cast<uint16_t>(FEATURE_REPORT | report[0]),
                     WHISKER_LIMIT_USB_HID_INTERFACE, static_cast<uint16_t>(report.size())};
    request.data = std::move(report);
    return request;
}

} // namespace

RequestSource::RequestSource(uint64_t seed) : random_(seed)
{
}

uint64_t RequestSource::below(uint64_t bound)
{
    return random_() % bound;
}

bool RequestSource::chance(uint64_t one_in)
{
    return below(one_in) == 0;
}

HostRequest RequestSource::control(bool run)
{
    const bool fast = !chance(5);
    Bytes report(WHISKER_REPORT_CONTROL_BYTES);
    report[WHISKER_REPORT_CONTROL_ID] = WHISKER_REPORT_ID_CONTROL;
    report[WHISKER_REPORT_CONTROL_WIRE_VERSION] = WHISKER_WIRE_VERSION;
    report[WHISKER_REPORT_CONTROL_RUN] = run;
    const auto divider = static_cast<uint8_t>(fast ? 6 + 2 * below(2) : 6 + 2 * below(14));
    report[WHISKER_REPORT_CONTROL_SCK_DIVIDER] = divider;
    report[WHISKER_REPORT_CONTROL_WORD_GAP] = static_cast<uint8_t>(30 + below(fast ? 10 : 226));
    report[WHISKER_REPORT_CONTROL_SAMPLE_POINT] = static_cast<uint8_t>(1 + below(divider));
    report[WHISKER_REPORT_CONTROL_OPTIONS] = static_cast<uint8_t>(chance(4) ? below(16) : 0);
    const auto mask = static_cast<uint32_t>(random_()) & ALL_LANES;
    whisker_put_u32(report.data() + WHISKER_REPORT_CONTROL_LANE_MASK, chance(3) ? mask : ALL_LANES);
    const uint64_t period = fast ? WHISKER_LIMIT_TICK_PERIOD : WHISKER_LIMIT_TICK_PERIOD_MIN + below(40000);
    whisker_put_u32(report.data() + WHISKER_REPORT_CONTROL_TICK_PERIOD,
                    chance(50) ? UINT32_MAX : static_cast<uint32_t>(period));
    return set_report(report);
}

HostRequest RequestSource::service()
{
    Bytes report(WHISKER_REPORT_SERVICE_BYTES);
    report[WHISKER_REPORT_SERVICE_ID] = WHISKER_REPORT_ID_SERVICE;
    report[WHISKER_REPORT_SERVICE_WIRE_VERSION] = WHISKER_WIRE_VERSION;
    const uint8_t info = chance(3) ? WHISKER_SERVICE_COMMAND_POLL : WHISKER_SERVICE_COMMAND_INFO;
    report[WHISKER_REPORT_SERVICE_COMMAND] = chance(6) ? static_cast<uint8_t>(below(9)) : info;
    report[WHISKER_REPORT_SERVICE_ARGUMENT] = static_cast<uint8_t>(below(32));
    for (size_t i = WHISKER_REPORT_SERVICE_DATA; i < report.size(); i++) {
        report[i] = static_cast<uint8_t>(random_());
    }
    return set_report(report);
}

// Few places, so that what one order writes another finds; some at the border of what may be written, some beyond.
HostRequest RequestSource::flash()
{
    static const uint32_t PLACES[] = {0, 4096, 4096 + 256 - 32, 0x3FFE0, 0x40000, 0xFFF00, 0xFFFFE0, 1u << 24, 33};
    Bytes report(WHISKER_REPORT_FLASH_BYTES);
    for (uint8_t &byte : report) {
        byte = static_cast<uint8_t>(random_());
    }
    report[WHISKER_REPORT_FLASH_ID] = WHISKER_REPORT_ID_FLASH;
    report[WHISKER_REPORT_FLASH_WIRE_VERSION] = chance(12) ? 0 : WHISKER_WIRE_VERSION;
    report[WHISKER_REPORT_FLASH_COMMAND] = static_cast<uint8_t>(below(chance(8) ? 8 : 4));
    const uint64_t places = chance(3) ? std::size(PLACES) : 4;
    whisker_put_u32(report.data() + WHISKER_REPORT_FLASH_ADDRESS, PLACES[below(places)] + 32 * (chance(3) ? 1 : 0));
    return set_report(report);
}

HostRequest RequestSource::get()
{
    HostRequest request;
    const uint16_t length = REPORT_LENGTHS[below(std::size(REPORT_LENGTHS))];
    uint64_t id = below(8);
    id += id >= WHISKER_REPORT_ID_TIMING; // it has a clock, and so differs
    request.setup = {GET_TYPE, GET_REPORT, static_cast<uint16_t>(FEATURE_REPORT | id), WHISKER_LIMIT_USB_HID_INTERFACE,
                     length};
    return request;
}

HostRequest RequestSource::any()
{
    static const uint8_t TYPES[] = {0x80, 0x00, 0x81, 0x01, 0x82, 0x02, 0xA1, 0x21, 0xC0, 0x40, 0xE0, 0x60, 0x83};
    static const uint16_t VALUES[] = {0,      1,      2,      0x0100, 0x0200, 0x0300, 0x0301, 0x0302, 0x0303,
                                      0x0600, 0x0700, 0x0F00, 0x0800, 0x2100, 0x2200, 0x0A00, 0x0304, 127};
    static const uint16_t INDICES[] = {0, 0, 1, 2, 7, 0x81, 0x82, 0x80, 0x0409, 0x01};
    static const uint16_t LENGTHS[] = {0, 0, 1, 2, 8, 9, 16, 18, 50, 64, 128, 178, 255, 1024};
    HostRequest request;
    request.setup = {TYPES[below(std::size(TYPES))], static_cast<uint8_t>(chance(8) ? 0x20 : below(13)),
                     VALUES[below(std::size(VALUES))], INDICES[below(std::size(INDICES))],
                     LENGTHS[below(std::size(LENGTHS))]};
    if (chance(3)) {
        request.setup.type = 0x80;
        request.setup.request = 6; // the descriptors are worth it
        request.setup.index = 0;
    }
    if (!request.setup.to_host()) {
        request.data.assign(request.setup.length, static_cast<uint8_t>(random_()));
    }
    return request;
}

} // namespace bridge_sim
