#include "frame_soak.h"

#include "sim_rng.h"
#include "whisker_protocol.h"

namespace bridge_sim
{

namespace
{

constexpr uint8_t BULK = 1;
constexpr size_t PACKET = WHISKER_LIMIT_BULK_PACKET;
constexpr uint64_t DISTURBED = 6;    // one step in so many
constexpr uint64_t RESET_ODDS = 300; // one disturbance in so many; a reset takes the time of 600 packets
constexpr uint64_t CONFIGURE_ODDS = 200;
constexpr uint64_t HALT_ODDS = 100;
constexpr uint64_t REQUEST_ODDS = 20;
constexpr uint64_t WORD = 8; // bytes that one hash fills
constexpr unsigned PATIENCE = 2000;
// A reset strikes up to this many cycles into a transaction: a bulk packet takes 530.
constexpr uint64_t TRANSACTION_CYCLES = 600;

uint64_t mix(uint64_t value)
{
    return sim_rng_mix(&value);
}

} // namespace

bool SoakResult::clean() const
{
    return gaps + duplicates + wrong + stale + answered + unexplained + hangs == 0;
}

FrameSoak::FrameSoak(StreamDevice &device, uint64_t seed) : device_(device), host_(device_), noise_(host_, seed)
{
    device_.byte = [this](uint64_t index) { return byte_of(stream_, index); };
    enumerate_device();
}

uint8_t FrameSoak::byte_of(uint64_t stream, uint64_t index) const
{
    return static_cast<uint8_t>(mix(stream << 40 | index / WORD) >> 8 * (index % WORD));
}

void FrameSoak::expect(bool condition)
{
    result_.hangs += condition ? 0 : 1;
}

void FrameSoak::begin_stream()
{
    accepted_ = 0;
    quiet_ = 0;
    copy_pending_ = false;
}

// The device asks for a new stream while it is reset, and again when it is configured; so does the next packet.
void FrameSoak::enumerate_device()
{
    stream_++;
    device_.available = 0;
    Descriptors descriptors;
    const char *error = nullptr;
    expect(enumerate(host_, descriptors, error));
    begin_stream();
}

const SoakResult &FrameSoak::run(uint64_t frames)
{
    while (result_.frames < frames && result_.hangs == 0) {
        step();
    }
    result_.unexplained = host_.counters().unexplained;
    result_.wire_faults = host_.counters().injected;
    result_.cycles = device_.cycles;
    return result_;
}

void FrameSoak::step()
{
    if (noise_.below(8) == 0) {
        device_.available += noise_.below(4 * PACKET);
    }
    if (device_.available < accepted_ + PACKET) {
        device_.available += PACKET * noise_.below(8);
    }
    if (noise_.below(DISTURBED) == 0) {
        disturb();
    }
    read_packet();
}

void FrameSoak::disturb()
{
    if (noise_.below(RESET_ODDS) == 0) {
        reset_at_any_cycle();
    } else if (noise_.below(CONFIGURE_ODDS) == 0) {
        configure();
    } else if (noise_.below(HALT_ODDS) == 0) {
        halt_and_clear();
    } else if (noise_.below(REQUEST_ODDS) == 0) {
        request();
    } else if (noise_.below(2) == 0) {
        arm();
    } else {
        make_noise();
    }
}

void FrameSoak::arm()
{
    constexpr WireFault FAULTS[] = {WireFault::LOST_ACK, WireFault::BAD_TOKEN, WireFault::BAD_DATA};
    host_.arm(FAULTS[noise_.below(3)]);
}

void FrameSoak::make_noise()
{
    result_.noise++;
    result_.answered += noise_.make(noise_.draw()) ? 0 : 1;
}

// Half of them with a damaged SETUP first. A class request between two descriptors must not move the second.
void FrameSoak::request()
{
    struct Question {
        SetupRequest setup;
        Outcome outcome;
        size_t size; // of the answer
    };
    constexpr Question QUESTIONS[] = {
        {{0x80, 0, 0, 0, 2}, Outcome::OK, 2},         {{0x80, 6, 0x0100, 0, 64}, Outcome::OK, 18},
        {{0x80, 6, 0x0200, 0, 255}, Outcome::OK, 50}, {{0x80, 6, 0x6300, 0, 255}, Outcome::STALL, 0},
        {{0xA1, 2, 0, 1, 1}, Outcome::OK, 1},         {{0xC0, 0x20, 0, 7, 255}, Outcome::OK, 178}};
    if (host_.armed() != WireFault::NONE) {
        return;
    }
    host_.arm(noise_.below(2) ? WireFault::BAD_SETUP : WireFault::NONE);
    Bytes data;
    const Question &question = QUESTIONS[noise_.below(sizeof QUESTIONS / sizeof QUESTIONS[0])];
    expect(control_transfer(host_, question.setup, data) == question.outcome);
    expect(data.size() == question.size);
}

// A packet whose ACK was lost would come again as DATA0, and no host could tell it from a new one: section 9.4.5 of
// USB 2.0.
void FrameSoak::halt_and_clear()
{
    if (copy_pending_ || host_.armed() != WireFault::NONE) {
        return;
    }
    Bytes data;
    expect(control_transfer(host_, {0x02, 3, 0, 0x80 | BULK, 0}, data) == Outcome::OK);
    expect(host_.in(BULK, PACKET, data) == Outcome::STALL);
    expect(control_transfer(host_, {0x02, 1, 0, 0x80 | BULK, 0}, data) == Outcome::OK);
    result_.restarts++;
}

void FrameSoak::configure()
{
    host_.arm(WireFault::NONE);
    stream_++;
    device_.available = 0;
    Bytes data;
    expect(control_transfer(host_, {0, 9, 1, 0, 0}, data) == Outcome::OK);
    result_.restarts++;
    begin_stream();
}

void FrameSoak::reset_at_any_cycle()
{
    host_.arm(WireFault::NONE);
    Bytes token = token_packet(PID_IN, static_cast<uint16_t>(host_.address() | BULK << 7));
    token.resize(noise_.below(4)); // at times not even the token is whole
    host_.bus().send(token);
    device_.in.tx_ready = 1;
    for (uint64_t left = noise_.below(TRANSACTION_CYCLES); left > 0; left--) {
        device_.cycle();
    }
    result_.resets++;
    enumerate_device();
}

void FrameSoak::read_packet()
{
    Bytes packet;
    const uint64_t lost = host_.armed() == WireFault::LOST_ACK;
    const Outcome outcome = host_.in(BULK, PACKET, packet);
    if (outcome == Outcome::OK) {
        quiet_ = 0;
        copy_pending_ = lost && host_.armed() == WireFault::NONE;
        take(packet);
        return;
    }
    const bool due = device_.available >= accepted_ + PACKET;
    quiet_ = due ? quiet_ + 1 : 0;
    expect(outcome == Outcome::NAK && quiet_ < PATIENCE);
}

void FrameSoak::take(const Bytes &packet)
{
    const auto holds = [&](uint64_t stream, uint64_t from) {
        for (size_t i = 0; i < packet.size(); i++) {
            if (packet[i] != byte_of(stream, from + i)) {
                return false;
            }
        }
        return true;
    };
    result_.packets++;
    if (holds(stream_, accepted_)) {
        accepted_ += packet.size();
        result_.frames += packet.size() / WHISKER_FRAME_BYTES;
    } else if (holds(stream_, accepted_ + PACKET)) {
        result_.gaps++;
        accepted_ += packet.size() + PACKET;
    } else if (accepted_ >= PACKET && holds(stream_, accepted_ - PACKET)) {
        result_.duplicates++;
    } else if (holds(stream_ - 1, accepted_)) {
        result_.stale++;
    } else {
        result_.wrong++;
    }
}

} // namespace bridge_sim
