// bridge-free-serve PORT: the bridge as on a board, on its own divider, with a start-of-frame packet every 125 us, for
// a Linux kernel by USB/IP at this port of 127.0.0.1 (0: any that is free). Its time stands still while nobody reads.
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <stdexcept>

#include <poll.h>

#include "rtl_rig.h"
#include "urb_scheduler.h"
#include "usbip_server.h"

using namespace bridge_sim;

namespace
{

constexpr uint64_t MICROFRAME = WHISKER_LIMIT_CLOCK_HZ / 8000;
constexpr uint64_t SEED = 1;

class FreeRig : public RtlRig
{
  public:
    FreeRig() : RtlRig(LANES, SEED, {})
    {
        bridge_.tick_by_itself();
        bridge_.run_nodes_by_itself();
    }

    Outcome in(uint8_t endpoint, size_t limit, Bytes &data) override
    {
        begin_frames();
        return RtlRig::in(endpoint, limit, data);
    }

    Outcome control(const SetupRequest &request, Bytes &data) override
    {
        begin_frames();
        return RtlRig::control(request, data);
    }

    bool ticks_by_itself() const override
    {
        return true;
    }

  private:
    void begin_frames()
    {
        for (; cycles() >= next_microframe_; next_microframe_ += MICROFRAME) {
            host_.start_of_frame();
        }
    }

    uint64_t next_microframe_ = 0;
};

void serve(uint16_t number)
{
    FreeRig rig;
    UrbScheduler scheduler(rig);
    UsbipServer port(number);
    Descriptors descriptors;
    const char *error = nullptr;
    if (!rig.power_on(descriptors, error)) {
        throw std::runtime_error(error);
    }
    port.plug(descriptors);
    std::printf("serving usbip at 127.0.0.1:%u\n", port.port());
    std::fflush(stdout);
    for (;;) {
        for (DeviceRequest &request : port.take_requests()) {
            if (request.discard) {
                scheduler.discard(request.urb.id);
            } else {
                scheduler.submit(std::move(request.urb));
            }
        }
        const bool progress = scheduler.step();
        port.deliver(scheduler.take_completed());
        pollfd wake = {port.wake_descriptor(), POLLIN, 0};
        if (!progress) {
            poll(&wake, 1, -1);
        }
    }
}

} // namespace

int main(int argc, char **argv)
{
    if (argc != 2) {
        std::fprintf(stderr, "bridge-free-serve: give a port, e.g. bridge-free-serve 0\n");
        return 2;
    }
    try {
        serve(static_cast<uint16_t>(std::strtoul(argv[1], nullptr, 10)));
    } catch (const std::exception &error) {
        std::fprintf(stderr, "bridge-free-serve: %s\n", error.what());
        return 1;
    }
}
