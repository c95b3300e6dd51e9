// Two simulated bridges on one host, the second's tick_in on the first's tick_out, beside a command that sees both
// under umockdev. Level bytes, 2 kHz of wall time.
//
// usage: umockdev-wrapper two_bridges [TICK:pull|put|miss:BRIDGE...] -- COMMAND...
// BRIDGE is 1 or 2 (serial numbers 0001 and 0002); miss: this bridge does not see the edge.
#include <algorithm>
#include <array>
#include <csignal>
#include <cstdio>
#include <deque>
#include <exception>
#include <stdexcept>

#include <poll.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include "bytes_rig.h"
#include "child.h"
#include "fault_log.h"
#include "pace.h"
#include "tick_runner.h"
#include "usbfs_server.h"

using namespace bridge_sim;

namespace
{

constexpr size_t NODES = 3;
constexpr unsigned MICROFRAMES_PER_TICK = WHISKER_LIMIT_TICK_PERIOD / (WHISKER_LIMIT_CLOCK_HZ / 8000);
constexpr int WAIT_MS = 100;
constexpr uint8_t GET_DESCRIPTOR = 6, SET_REPORT = 9, STRING = 3;

struct Event {
    uint64_t tick = 0;
    std::string word;
    size_t bridge = 0;
};

// The string descriptor "0001" reads "0002" on the second, which refuses to run on ticks of its own.
class NumberedRig : public BytesRig
{
  public:
    explicit NumberedRig(size_t number) : BytesRig(NODES, number, {}), digit_(static_cast<uint8_t>('0' + number))
    {
    }

    Outcome control(const SetupRequest &request, Bytes &data) override
    {
        const bool starts = request.request == SET_REPORT && data.size() == WHISKER_REPORT_CONTROL_BYTES &&
                            data[WHISKER_REPORT_CONTROL_ID] == WHISKER_REPORT_ID_CONTROL &&
                            data[WHISKER_REPORT_CONTROL_RUN] == 1;
        if (starts && digit_ == '2' && !(data[WHISKER_REPORT_CONTROL_OPTIONS] & WHISKER_CONTROL_OPTION_TICK_IN)) {
            return Outcome::STALL;
        }
        static const Bytes serial = {10, STRING, '0', 0, '0', 0, '0', 0, '1', 0};
        const Outcome outcome = BytesRig::control(request, data);
        if (request.request == GET_DESCRIPTOR && data == serial) {
            data[serial.size() - 2] = digit_;
        }
        return outcome;
    }

  private:
    uint8_t digit_;
};

class Bridge
{
  public:
    Bridge(size_t number, const UsbfsServer *beside)
        : rig_(number), scheduler_(rig_), log_("", ""), runner_(rig_, scheduler_, std::nullopt, log_), port_(beside)
    {
        scheduler_.plug(false);
    }

    void plug()
    {
        Descriptors descriptors;
        const char *error = nullptr;
        if (!rig_.power_cycle(descriptors, error)) {
            throw std::runtime_error(error);
        }
        scheduler_.plug(true);
        port_.plug(descriptors);
        plugged_ = true;
    }

    void unplug()
    {
        serve();
        scheduler_.plug(false);
        runner_.unplugged();
        rig_.forget_frames();
        serve();
        port_.unplug();
        serve();
        plugged_ = false;
    }

    // Takes what the host asks for, makes a transaction, hands results over. False: there was nothing to do.
    bool serve()
    {
        for (DeviceRequest &request : port_.take_requests()) {
            if (request.discard) {
                scheduler_.discard(request.urb.id);
            } else {
                scheduler_.submit(std::move(request.urb));
            }
        }
        const bool stepped = scheduler_.step();
        port_.deliver(scheduler_.take_completed());
        return stepped;
    }

    bool running() const
    {
        return plugged_ && rig_.running();
    }

    bool may_tick() const
    {
        return !running() || (scheduler_.stop_seen() ? runner_.may_end() : runner_.ready());
    }

    void tick(uint64_t number, const sim_field *fields)
    {
        scheduler_.stop_seen() ? runner_.last_tick(fields) : runner_.tick(number, fields);
    }

    void wait_until(uint64_t microframe)
    {
        rig_.wait_until(microframe);
    }

    int descriptor() const
    {
        return port_.wake_descriptor();
    }

    const UsbfsServer *port() const
    {
        return &port_;
    }

  private:
    NumberedRig rig_;
    UrbScheduler scheduler_;
    FaultLog log_;
    TickRunner runner_;
    UsbfsServer port_;
    bool plugged_ = false;
};

class Pair
{
  public:
    explicit Pair(std::deque<Event> events) : events_(std::move(events))
    {
        first_.plug();
        second_.plug();
    }

    int run(const std::vector<std::string> &command, int signals)
    {
        Child child(command);
        while (!child.ended()) {
            bool progress = advance();
            progress |= first_.serve();
            progress |= second_.serve();
            std::array<pollfd, 3> all = {
                {{signals, POLLIN, 0}, {first_.descriptor(), POLLIN, 0}, {second_.descriptor(), POLLIN, 0}}};
            poll(all.data(), all.size(), progress ? 0 : pace_.wait_ms(tick_, WAIT_MS));
            signalfd_siginfo info;
            if (all[0].revents && read(signals, &info, sizeof info) > 0 && info.ssi_signo == SIGTERM) {
                child.ask_to_end();
            }
        }
        return child.exit_code();
    }

  private:
    // A tick of the world, which the first bridge makes for both; when it is away time passes. Time begins with a run.
    bool advance()
    {
        if (tick_ == 0 && !first_.running()) {
            return false;
        }
        const bool ready = first_.may_tick() && (!first_.running() || second_.may_tick());
        if (!ready || !pace_.due(tick_)) {
            return false;
        }
        bool missed = false;
        for (; !events_.empty() && events_.front().tick <= tick_; events_.pop_front()) {
            missed |= obey(events_.front());
        }
        const std::array<sim_field, LANES> fields{};
        if (first_.running()) {
            first_.tick(tick_, fields.data());
            if (second_.running() && !missed) {
                second_.tick(tick_, fields.data());
            }
        }
        tick_++;
        first_.wait_until(tick_ * MICROFRAMES_PER_TICK);
        second_.wait_until(tick_ * MICROFRAMES_PER_TICK);
        return true;
    }

    // True: the second bridge does not see this edge.
    bool obey(const Event &event)
    {
        Bridge &bridge = event.bridge == 1 ? first_ : second_;
        if (event.word == "put") {
            bridge.plug();
        } else if (event.word == "pull") {
            bridge.unplug();
        }
        return event.word == "miss";
    }

    Bridge first_{1, nullptr};
    Bridge second_{2, first_.port()};
    std::deque<Event> events_;
    Pace pace_{1};
    uint64_t tick_ = 0;
};

Event parse(const std::string &text)
{
    const size_t word = text.find(':'), bridge = text.rfind(':');
    if (word == bridge) {
        throw std::runtime_error(text + ": give TICK:pull|put|miss:BRIDGE");
    }
    return {std::stoull(text), text.substr(word + 1, bridge - word - 1), std::stoul(text.substr(bridge + 1))};
}

int block_signals()
{
    sigset_t set;
    sigemptyset(&set);
    sigaddset(&set, SIGCHLD);
    sigaddset(&set, SIGTERM);
    sigprocmask(SIG_BLOCK, &set, nullptr);
    return signalfd(-1, &set, SFD_NONBLOCK | SFD_CLOEXEC);
}

} // namespace

int main(int argc, char **argv)
{
    try {
        const std::vector<std::string> words(argv + 1, argv + argc);
        const auto dashes = std::find(words.begin(), words.end(), "--");
        std::deque<Event> events;
        std::transform(words.begin(), dashes, std::back_inserter(events), parse);
        if (dashes == words.end() || dashes + 1 == words.end()) {
            throw std::runtime_error("give a command after --");
        }
        const int signals = block_signals(); // before umockdev starts its thread
        return Pair(std::move(events)).run({dashes + 1, words.end()}, signals);
    } catch (const std::exception &error) {
        std::fprintf(stderr, "two_bridges: %s\n", error.what());
        return 2;
    }
}
