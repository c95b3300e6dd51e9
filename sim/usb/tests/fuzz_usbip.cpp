// Whatever bytes a client sends, in whatever pieces: the decoder gives messages that hold what they say, or refuses
// with an exception, and never reads beyond what came.
#include <cstdlib>
#include <stdexcept>

#include "usbip_codec.h"

namespace
{

void check(const bridge_sim::UsbipMessage &message)
{
    const bool to_device = message.kind == bridge_sim::UsbipMessage::Kind::SUBMIT && !message.to_host;
    const size_t due = to_device ? message.length : 0;
    if (message.data.size() != due || message.length > bridge_sim::USBIP_TRANSFER_MAX || message.endpoint > 15 ||
        message.bus_id.size() > 32) {
        std::abort();
    }
}

} // namespace

// The first byte says how long the pieces are.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t count)
{
    bridge_sim::UsbipDecoder decoder;
    const size_t piece = count > 0 ? bytes[0] + size_t{1} : 1;
    try {
        for (size_t at = 1; at < count; at += piece) {
            decoder.feed(bytes + at, count - at < piece ? count - at : piece);
            while (const auto message = decoder.next()) {
                check(*message);
            }
        }
    } catch (const std::runtime_error &) {
        return 0;
    }
    return 0;
}
