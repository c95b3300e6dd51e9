// usb-soak FRAMES [SEED]: frames through the USB device with faults, noise and resets; prints what came of it as JSON.
#include <cinttypes>
#include <cstdio>
#include <cstdlib>

#include "frame_soak.h"
#include "usb_device.h"

int main(int argc, char **argv)
{
    if (argc < 2) {
        std::fprintf(stderr, "usb-soak: give the number of frames, e.g. usb-soak 100000 1\n");
        return 2;
    }
    bridge_sim::UsbDevice device;
    bridge_sim::FrameSoak soak(device, argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 1);
    const bridge_sim::SoakResult &result = soak.run(std::strtoull(argv[1], nullptr, 10));
    std::printf("{\"frames\": %" PRIu64 ", \"packets\": %" PRIu64 ", \"gaps\": %" PRIu64 ", \"duplicates\": %" PRIu64
                ", \"wrong\": %" PRIu64 ", \"stale\": %" PRIu64 ", \"wire_faults\": %" PRIu64 ", \"noise\": %" PRIu64
                ", \"answered\": %" PRIu64 ", \"resets\": %" PRIu64 ", \"restarts\": %" PRIu64
                ", \"unexplained\": %" PRIu64 ", \"hangs\": %" PRIu64 ", \"cycles\": %" PRIu64 "}\n",
                result.frames, result.packets, result.gaps, result.duplicates, result.wrong, result.stale,
                result.wire_faults, result.noise, result.answered, result.resets, result.restarts, result.unexplained,
                result.hangs, result.cycles);
    return result.clean() ? 0 : 1;
}
