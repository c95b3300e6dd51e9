#include "level_script.h"

#include <algorithm>

namespace bridge_sim
{

namespace
{

constexpr uint8_t SET_CONFIGURATION = 9, SET_FEATURE = 3, CLEAR_FEATURE = 1, TO_ENDPOINT = 2;
constexpr double RANGE_DEG = 60, STEP_DEG = 25; // a node does not believe more than 30 in a tick
constexpr unsigned FIFO_FRAMES = WHISKER_LIMIT_FIFO_BYTES / WHISKER_FRAME_BYTES;
constexpr unsigned ENDPOINT_FRAMES = 4;

} // namespace

const std::vector<LevelScript::Step> LevelScript::STEPS = {
    {"ticks", 30, &LevelScript::some_ticks},
    {"pause", 1, &LevelScript::pause},
    {"read", 16, &LevelScript::read_some},
    {"drain", 5, &LevelScript::drain},
    {"start", 14, &LevelScript::start},
    {"stop", 6, &LevelScript::stop},
    {"settings", 4, &LevelScript::settings},
    {"refused settings", 5, &LevelScript::refused_settings},
    {"service", 12, &LevelScript::service},
    {"refused service", 3, &LevelScript::refused_service},
    {"reports", 5, &LevelScript::read_reports},
    {"request", 8, &LevelScript::any_request},
    {"flash", 4, &LevelScript::flash},
    {"halt", 3, &LevelScript::halt_endpoint},
    {"configure", 2, &LevelScript::configure},
    {"bus reset", 1, &LevelScript::bus_reset},
    {"power cycle", 1, &LevelScript::power_cycle},
    {"lane fault", 14, &LevelScript::lane_fault},
    {"wire fault", 6, &LevelScript::wire_fault},
};

LevelScript::LevelScript(LevelPair &pair, size_t populated, uint64_t seed)
    : pair_(pair), populated_(populated), draw_(seed)
{
}

const std::map<std::string, uint64_t> &LevelScript::taken() const
{
    return taken_;
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
    uint64_t drawn = draw_.below(total);
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
        angle += STEP_DEG * (static_cast<double>(draw_.below(2001)) / 1000.0 - 1.0);
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
    return draw_.chance(3) ? draw_.get() : draw_.chance(2) ? draw_.service() : draw_.control(run_);
}

void LevelScript::some_ticks()
{
    for (uint64_t i = draw_.below(6) + 1; i > 0; i--) {
        tick(draw_.chance(6));
    }
}

// The host does not read until frames are dropped.
void LevelScript::pause()
{
    if (!pair_.running()) {
        start();
    }
    for (uint64_t i = FIFO_FRAMES + ENDPOINT_FRAMES - 2 + draw_.below(8); i > 0; i--) {
        tick(false);
    }
}

void LevelScript::read_some()
{
    for (uint64_t i = draw_.below(4) + 1; i > 0; i--) {
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
    fault.lane = draw_.below(populated_);
    fault.kind = static_cast<LaneFaultKind>(draw_.below(LANE_FAULT_KINDS));
    fault.argument = static_cast<unsigned>(draw_.below(RECORD_BITS));
    pair_.spoil(fault);
}

void LevelScript::wire_fault()
{
    static const WireFault FAULTS[] = {WireFault::LOST_ACK, WireFault::BAD_TOKEN, WireFault::BAD_DATA,
                                       WireFault::BAD_SETUP};
    pair_.arm(FAULTS[draw_.below(std::size(FAULTS))]);
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
    if (outcome == Outcome::OK && request.setup.value == (FEATURE_REPORT | WHISKER_REPORT_ID_CONTROL) &&
        request.setup.type == SET_REPORT_TYPE) {
        run_ = request.data[WHISKER_REPORT_CONTROL_RUN] != 0;
        stop_asked_ = stop_asked_ || (ran && !run_ && ticked_);
    }
    if (!pair_.running()) {
        forget_run();
    }
}

void LevelScript::start()
{
    control(draw_.control(true));
}

void LevelScript::stop()
{
    control(draw_.control(false));
    if (!draw_.chance(4)) {
        tick(false);
    }
}

void LevelScript::settings()
{
    control(draw_.control(run_));
}

// One byte is another, or the length is.
void LevelScript::refused_settings()
{
    HostRequest request = draw_.control(run_);
    if (draw_.chance(5)) {
        request.data.resize(1 + draw_.below(64));
        request.setup.length = static_cast<uint16_t>(request.data.size());
    } else {
        request.data[draw_.below(request.data.size())] =
            static_cast<uint8_t>(draw_.chance(2) ? draw_.below(8) : draw_.below(UINT64_MAX));
    }
    control(request);
}

void LevelScript::service()
{
    control(draw_.service());
    tick(false);
    if (draw_.chance(2)) {
        tick(false);
        control(draw_.service());
        tick(false);
    }
    read_reports();
}

void LevelScript::refused_service()
{
    HostRequest request = draw_.service();
    request.data[draw_.below(2)] ^= static_cast<uint8_t>(1u << draw_.below(8));
    control(request);
    control(draw_.service());
    control(draw_.service()); // while one is pending
}

// Orders are refused while a run is in progress.
void LevelScript::flash()
{
    for (uint64_t i = draw_.below(5) + 1; i > 0; i--) {
        taken_["order to the flash carried out"] += pair_.flash(draw_.flash()) == Outcome::OK;
    }
}

void LevelScript::read_reports()
{
    for (const unsigned id : {WHISKER_REPORT_ID_CONTROL, WHISKER_REPORT_ID_COUNTERS, WHISKER_REPORT_ID_IDENTITY,
                              WHISKER_REPORT_ID_ANSWERS, WHISKER_REPORT_ID_FLASH}) {
        HostRequest request = draw_.get();
        request.setup.value = static_cast<uint16_t>(FEATURE_REPORT | id);
        request.setup.length = UINT8_MAX;
        control(request);
    }
}

// ------------------------------------------------------------------------------------------------------------ device

void LevelScript::any_request()
{
    for (unsigned i = 0; i < 4; i++) {
        control(draw_.any());
        run_ = run_ && pair_.running();
    }
}

void LevelScript::halt_endpoint()
{
    static const uint16_t ENDPOINTS[] = {WHISKER_LIMIT_USB_BULK_IN, WHISKER_LIMIT_USB_HID_IN};
    const uint16_t endpoint = ENDPOINTS[draw_.below(2)];
    HostRequest request;
    if (draw_.chance(2)) {
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
    request.setup = {0, SET_CONFIGURATION, static_cast<uint16_t>(!draw_.chance(4)), 0, 0};
    control(request);
    pair_.read_packet();
    request.setup.value = 1;
    control(request);
    run_ = false;
}

void LevelScript::bus_reset()
{
    draw_fields();
    pair_.bus_reset(takes_tick() && draw_.chance(2), fields_.data());
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
