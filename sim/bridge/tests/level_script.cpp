#include "level_script.h"

#include <algorithm>

namespace bridge_sim
{

namespace
{

constexpr uint8_t SET_TYPE = 0x21, GET_TYPE = 0xA1, SET_REPORT = 9, GET_REPORT = 1;
constexpr uint16_t FEATURE = 0x0300;
constexpr uint8_t SET_CONFIGURATION = 9, SET_FEATURE = 3, CLEAR_FEATURE = 1, TO_ENDPOINT = 2;
constexpr uint32_t ALL_LANES = UINT32_MAX >> (32 - LANES);
constexpr uint16_t REPORT_LENGTHS[] = {0, 1, 16, 64, 100, 176, 255};
constexpr double RANGE_DEG = 60, STEP_DEG = 25; // a node does not believe more than 30 in a tick
constexpr unsigned FIFO_FRAMES = WHISKER_LIMIT_FIFO_BYTES / WHISKER_FRAME_BYTES;
constexpr unsigned ENDPOINT_FRAMES = 4;

HostRequest set_report(Bytes report)
{
    HostRequest request;
    request.setup = {SET_TYPE, SET_REPORT, static_cast<uint16_t>(FEATURE | report[0]), WHISKER_LIMIT_USB_HID_INTERFACE,
                     static_cast<uint16_t>(report.size())};
    request.data = std::move(report);
    return request;
}

} // namespace

const std::vector<LevelScript::Step> LevelScript::STEPS = {
    {"ticks", 30, &LevelScript::some_ticks},      {"pause", 1, &LevelScript::pause},
    {"read", 16, &LevelScript::read_some},        {"drain", 5, &LevelScript::drain},
    {"start", 14, &LevelScript::start},           {"stop", 6, &LevelScript::stop},
    {"settings", 4, &LevelScript::settings},      {"refused settings", 5, &LevelScript::refused_settings},
    {"service", 12, &LevelScript::service},       {"refused service", 3, &LevelScript::refused_service},
    {"reports", 5, &LevelScript::read_reports},   {"request", 8, &LevelScript::any_request},
    {"halt", 3, &LevelScript::halt_endpoint},     {"configure", 2, &LevelScript::configure},
    {"bus reset", 1, &LevelScript::bus_reset},    {"power cycle", 1, &LevelScript::power_cycle},
    {"lane fault", 14, &LevelScript::lane_fault}, {"wire fault", 6, &LevelScript::wire_fault},
};

LevelScript::LevelScript(LevelPair &pair, size_t populated, uint64_t seed)
    : pair_(pair), populated_(populated), random_(seed)
{
}

const std::map<std::string, uint64_t> &LevelScript::taken() const
{
    return taken_;
}

uint64_t LevelScript::below(uint64_t bound)
{
    return random_() % bound;
}

bool LevelScript::chance(uint64_t one_in)
{
    return below(one_in) == 0;
}

void LevelScript::run()
{
    constexpr unsigned STEPS_OF_SCRIPT = 16;
    for (unsigned i = 0; i < STEPS_OF_SCRIPT; i++) {
        step();
    }
    read_reports();
}

void LevelScript::step()
{
    uint64_t total = 0;
    for (const Step &step : STEPS) {
        total += step.weight;
    }
    uint64_t drawn = below(total);
    for (const Step &step : STEPS) {
        if (drawn < step.weight) {
            taken_[step.name]++;
            return (this->*step.take)();
        }
        drawn -= step.weight;
    }
}

// ------------------------------------------------------------------------------------------------------------- ticks

bool LevelScript::takes_tick() const
{
    return pair_.running() && !last_made_;
}

void LevelScript::draw_fields()
{
    const auto wander = [this](double &angle) {
        angle += STEP_DEG * (static_cast<double>(below(2001)) / 1000.0 - 1.0);
        angle = std::clamp(angle, -RANGE_DEG, RANGE_DEG);
    };
    for (sim_field &field : fields_) {
        wander(field.alpha_deg);
        wander(field.beta_deg);
    }
}

void LevelScript::tick(bool with_request)
{
    if (!takes_tick()) {
        return;
    }
    draw_fields();
    last_made_ = stop_asked_;
    ticked_ = true;
    std::optional<HostRequest> meanwhile;
    if (with_request) {
        meanwhile = request_meanwhile();
        taken_["request in a tick"]++;
    }
    pair_.tick(fields_.data(), meanwhile);
    if (!pair_.running()) {
        forget_run();
    }
}

// One that changes nothing of the run, for then the script would have to know when in the tick it came.
HostRequest LevelScript::request_meanwhile()
{
    return chance(3) ? get_report() : chance(2) ? service_report() : control_report(run_);
}

void LevelScript::some_ticks()
{
    for (uint64_t i = below(6) + 1; i > 0; i--) {
        tick(chance(6));
    }
}

// The host does not read until frames are dropped.
void LevelScript::pause()
{
    if (!pair_.running()) {
        start();
    }
    for (uint64_t i = FIFO_FRAMES + ENDPOINT_FRAMES - 2 + below(8); i > 0; i--) {
        tick(false);
    }
}

void LevelScript::read_some()
{
    for (uint64_t i = below(4) + 1; i > 0; i--) {
        pair_.read_packet();
    }
    if (!pair_.running()) {
        forget_run();
    }
}

void LevelScript::drain()
{
    while (pair_.read_packet() == Outcome::OK) {
    }
    if (!pair_.running()) {
        forget_run();
    }
}

void LevelScript::lane_fault()
{
    LaneFault fault{};
    fault.lane = below(populated_);
    fault.kind = static_cast<LaneFaultKind>(below(LANE_FAULT_KINDS));
    fault.argument = static_cast<unsigned>(below(RECORD_BITS));
    pair_.spoil(fault);
}

void LevelScript::wire_fault()
{
    static const WireFault KINDS[] = {WireFault::LOST_ACK, WireFault::BAD_TOKEN, WireFault::BAD_DATA,
                                      WireFault::BAD_SETUP};
    pair_.arm(KINDS[below(std::size(KINDS))]);
}

// ----------------------------------------------------------------------------------------------------------- reports

void LevelScript::forget_run()
{
    ticked_ = stop_asked_ = last_made_ = false;
}

void LevelScript::control(const HostRequest &request)
{
    const bool ran = pair_.running();
    const Outcome outcome = pair_.control(request);
    if (outcome == Outcome::OK && request.setup.value == (FEATURE | WHISKER_REPORT_ID_CONTROL) &&
        request.setup.type == SET_TYPE) {
        run_ = request.data[WHISKER_REPORT_CONTROL_RUN] != 0;
        stop_asked_ = stop_asked_ || (ran && !run_ && ticked_);
    }
    if (!pair_.running()) {
        forget_run();
    }
}

HostRequest LevelScript::control_report(bool run)
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
    const auto mask = static_cast<uint32_t>(random_()) & ALL_LANES;
    whisker_put_u32(report.data() + WHISKER_REPORT_CONTROL_LANE_MASK, chance(3) ? mask : ALL_LANES);
    const uint64_t period = fast ? WHISKER_LIMIT_TICK_PERIOD : WHISKER_LIMIT_TICK_PERIOD_MIN + below(40000);
    whisker_put_u32(report.data() + WHISKER_REPORT_CONTROL_TICK_PERIOD,
                    chance(50) ? UINT32_MAX : static_cast<uint32_t>(period));
    return set_report(report);
}

HostRequest LevelScript::service_report()
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

HostRequest LevelScript::get_report()
{
    HostRequest request;
    const uint16_t length = REPORT_LENGTHS[below(std::size(REPORT_LENGTHS))];
    request.setup = {GET_TYPE, GET_REPORT, static_cast<uint16_t>(FEATURE | below(7)), WHISKER_LIMIT_USB_HID_INTERFACE,
                     length};
    return request;
}

void LevelScript::start()
{
    control(control_report(true));
}

void LevelScript::stop()
{
    control(control_report(false));
    if (!chance(4)) {
        tick(false);
    }
}

void LevelScript::settings()
{
    control(control_report(run_));
}

// One byte is another, or the length is.
void LevelScript::refused_settings()
{
    HostRequest request = control_report(run_);
    if (chance(5)) {
        request.data.resize(1 + below(64));
        request.setup.length = static_cast<uint16_t>(request.data.size());
    } else {
        request.data[below(request.data.size())] = static_cast<uint8_t>(chance(2) ? below(8) : random_());
    }
    control(request);
}

void LevelScript::service()
{
    control(service_report());
    tick(false);
    if (chance(2)) {
        tick(false);
        control(service_report());
        tick(false);
    }
    read_reports();
}

void LevelScript::refused_service()
{
    HostRequest request = service_report();
    request.data[below(2)] ^= static_cast<uint8_t>(1u << below(8));
    control(request);
    control(service_report());
    control(service_report()); // while one is pending
}

void LevelScript::read_reports()
{
    for (const uint8_t id : {WHISKER_REPORT_ID_CONTROL, WHISKER_REPORT_ID_COUNTERS, WHISKER_REPORT_ID_IDENTITY,
                             WHISKER_REPORT_ID_ANSWERS}) {
        HostRequest request = get_report();
        request.setup.value = static_cast<uint16_t>(FEATURE | id);
        request.setup.length = UINT8_MAX;
        control(request);
    }
}

// ------------------------------------------------------------------------------------------------------------ device

HostRequest LevelScript::some_request()
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

void LevelScript::any_request()
{
    for (unsigned i = 0; i < 4; i++) {
        control(some_request());
        run_ = run_ && pair_.running();
    }
}

void LevelScript::halt_endpoint()
{
    static const uint16_t ENDPOINTS[] = {WHISKER_LIMIT_USB_BULK_IN, WHISKER_LIMIT_USB_HID_IN};
    const uint16_t endpoint = ENDPOINTS[below(2)];
    HostRequest request;
    if (chance(2)) {
        request.setup = {TO_ENDPOINT, SET_FEATURE, 0, endpoint, 0};
        control(request);
        pair_.in(endpoint & 0xFu);
    }
    request.setup = {TO_ENDPOINT, CLEAR_FEATURE, 0, endpoint, 0};
    control(request);
    pair_.in(endpoint & 0xFu);
    if (!pair_.running()) {
        forget_run();
    }
}

void LevelScript::configure()
{
    HostRequest request;
    request.setup = {0, SET_CONFIGURATION, static_cast<uint16_t>(!chance(4)), 0, 0};
    control(request);
    pair_.read_packet();
    request.setup.value = 1;
    control(request);
    run_ = false;
}

void LevelScript::bus_reset()
{
    draw_fields();
    pair_.bus_reset(takes_tick() && chance(2), fields_.data());
    run_ = false;
    forget_run();
}

void LevelScript::power_cycle()
{
    pair_.power_cycle();
    run_ = false;
    forget_run();
}

} // namespace bridge_sim
