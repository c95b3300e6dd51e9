#include "ulpi_device.h"

#include "Vulpi_device.h"

namespace bridge_sim
{

namespace
{

// ULPI 1.1, section 3.8.2.6: a high-speed link's decision time.
constexpr unsigned LINK_DECISION = 14;

} // namespace

UlpiDevice::UlpiDevice(const PhyTraits &traits) : top_(std::make_unique<Vulpi_device>()), phy_(traits)
{
    power_up(*top_);
}

UlpiDevice::~UlpiDevice() = default;

bool UlpiDevice::suspended() const
{
    return top_->suspended;
}

unsigned UlpiDevice::answer_limit() const
{
    return LINK_DECISION;
}

bool UlpiDevice::ready() const
{
    return top_->ready;
}

const UlpiPhy &UlpiDevice::phy() const
{
    return phy_;
}

void UlpiDevice::cycle()
{
    Vulpi_device &top = *top_;
    const PhyPins pins = phy_.speak(in);
    top.ulpi_dir = pins.dir;
    top.ulpi_nxt = pins.nxt;
    top.ulpi_data_in = pins.data;
    clock(top, [&] {
        // The pads let go while dir is high and in the cycle after it.
        const bool drives = !pins.dir && !dir_before_;
        dir_before_ = pins.dir;
        phy_.listen({static_cast<uint8_t>(drives ? top.ulpi_data_out : 0), top.ulpi_stp != 0}, out);
        answered_after(phy_.answered_after());
    });
}

} // namespace bridge_sim
