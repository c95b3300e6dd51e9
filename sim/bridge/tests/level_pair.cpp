#include "level_pair.h"
#include "make_rig.h"

#include <algorithm>
#include <utility>

namespace bridge_sim
{

namespace
{

// Gateware needs time for what level bytes does at once: a frame is made in 260 cycles, a packet of 512 bytes goes to
// the endpoint's buffer at one a cycle, and then a frame that waited for room follows.
constexpr uint64_t SETTLE_CYCLES = 900;
// After what leaves frames and packets where they are.
constexpr uint64_t REST_CYCLES = 32;

std::string text_of(Outcome outcome, const Bytes &data)
{
    return "outcome " + std::to_string(static_cast<int>(outcome)) + " " + std::string(data.begin(), data.end());
}

} // namespace

LevelPair::LevelPair(size_t populated, uint64_t seed)
    : rigs_{make_rig(Level::RTL, populated, seed), make_rig(Level::BYTES, populated, seed)}
{
    both("power on", REST_CYCLES, [](Rig &rig) {
        Descriptors descriptors;
        const char *error = nullptr;
        const bool on = rig.power_on(descriptors, error);
        return text_of(on ? Outcome::OK : Outcome::TIMEOUT, descriptors.all());
    });
}

// What one level says, then what the other does.
template <typename Action> void LevelPair::both(const char *what, uint64_t rest, Action action)
{
    for (size_t i = 0; i < 2; i++) {
        answers_[i] = action(*rigs_[i]);
        rigs_[i]->idle(rest);
        answers_[i] += rigs_[i]->running() ? " running" : " idle";
        answers_[i] += " faults " + std::to_string(rigs_[i]->counters().injected);
    }
    compare(what);
}

void LevelPair::compare(const std::string &what)
{
    const std::string &rtl = answers_[0];
    const std::string &model = answers_[1];
    if (rtl == model) {
        return;
    }
    const size_t shorter = std::min(rtl.size(), model.size());
    const auto shorter_end = rtl.begin() + static_cast<std::ptrdiff_t>(shorter);
    const auto at = std::mismatch(rtl.begin(), shorter_end, model.begin()).first - rtl.begin();
    const auto printable = [](const std::string &text) {
        std::string shown;
        for (const char c : text) {
            static const char DIGITS[] = "0123456789abcdef";
            const auto byte = static_cast<unsigned char>(c);
            shown += byte >= ' ' && byte < 0x7F ? std::string(1, c)
                                                : std::string{'\\', DIGITS[byte >> 4], DIGITS[byte & 15]};
        }
        return shown;
    };
    throw std::runtime_error(what + ": differs at " + std::to_string(at) + "\nrtl:   " + printable(rtl) +
                             "\nbytes: " + printable(model));
}

Outcome LevelPair::control(const HostRequest &request)
{
    Outcome outcome = Outcome::OK;
    const SetupRequest &s = request.setup;
    const std::string what = "request " + std::to_string(s.type) + " " + std::to_string(s.request) + " value " +
                             std::to_string(s.value) + " index " + std::to_string(s.index) + " length " +
                             std::to_string(s.length);
    both(what.c_str(), REST_CYCLES, [&](Rig &rig) {
        Bytes data = request.data;
        outcome = rig.control(request.setup, data);
        return text_of(outcome, data);
    });
    stalls += outcome == Outcome::STALL ? 1 : 0;
    return outcome;
}

Outcome LevelPair::flash(const HostRequest &request)
{
    constexpr unsigned PATIENCE = 1000;
    constexpr SetupRequest GET = {0xA1, 1, 0x0300 | WHISKER_REPORT_ID_FLASH, WHISKER_LIMIT_USB_HID_INTERFACE, 255};
    Outcome outcome = Outcome::OK;
    both("flash", REST_CYCLES, [&](Rig &rig) {
        Bytes data = request.data, report;
        outcome = rig.control(request.setup, data);
        for (unsigned i = 0; i < PATIENCE && (report.empty() || report[WHISKER_REPORT_FLASH_BUSY]); i++) {
            rig.control(GET, report);
        }
        return text_of(outcome, report);
    });
    stalls += outcome == Outcome::STALL ? 1 : 0;
    return outcome;
}

Outcome LevelPair::read_packet()
{
    return in(WHISKER_LIMIT_USB_BULK_IN & 0xFu);
}

Outcome LevelPair::in(uint8_t endpoint)
{
    Outcome outcome = Outcome::OK;
    Bytes data;
    both("IN", SETTLE_CYCLES, [&](Rig &rig) {
        data.clear();
        outcome = rig.in(endpoint, WHISKER_LIMIT_BULK_PACKET, data);
        return text_of(outcome, data);
    });
    packets += outcome == Outcome::OK ? 1 : 0;
    empty_packets += outcome == Outcome::OK && data.empty() ? 1 : 0;
    return outcome;
}

void LevelPair::tick(const sim_field *fields, const std::optional<HostRequest> &meanwhile)
{
    both("tick", SETTLE_CYCLES, [&](Rig &rig) {
        bool to_do = meanwhile.has_value();
        std::string answer;
        rig.tick(fields, [&] {
            if (to_do) {
                Bytes data = meanwhile->data;
                const Outcome outcome = rig.control(meanwhile->setup, data);
                answer = text_of(outcome, data);
            }
            return std::exchange(to_do, false);
        });
        return answer;
    });
}

void LevelPair::bus_reset(bool within_tick, const sim_field *fields)
{
    both("bus reset", REST_CYCLES, [&](Rig &rig) {
        Descriptors descriptors;
        bool to_do = true;
        bool done = false;
        const auto reset = [&] {
            const char *error = nullptr;
            done = done || (to_do && rig.enumerate(descriptors, error));
            rig.forget_frames();
            return std::exchange(to_do, false);
        };
        if (within_tick) {
            rig.tick(fields, reset);
        } else {
            reset();
        }
        return text_of(done ? Outcome::OK : Outcome::TIMEOUT, descriptors.all());
    });
}

void LevelPair::power_cycle()
{
    both("power cycle", REST_CYCLES, [](Rig &rig) {
        Descriptors descriptors;
        const char *error = nullptr;
        const bool on = rig.power_cycle(descriptors, error);
        return text_of(on ? Outcome::OK : Outcome::TIMEOUT, descriptors.all());
    });
}

void LevelPair::spoil(const LaneFault &fault)
{
    for (const auto &rig : rigs_) {
        rig->spoil(fault);
    }
}

void LevelPair::arm(WireFault fault)
{
    for (const auto &rig : rigs_) {
        rig->arm(fault);
    }
}

bool LevelPair::running() const
{
    return rigs_[0]->running();
}

} // namespace bridge_sim
