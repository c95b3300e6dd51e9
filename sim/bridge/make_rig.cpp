#include "make_rig.h"

#include "mixed_rig.h"
#include "rtl_rig.h"

namespace bridge_sim
{

std::unique_ptr<Rig> make_rig(Level level, size_t populated, uint64_t seed, const std::vector<NodeTrait> &traits,
                              uint64_t rtl_ticks)
{
    if (level == Level::MIXED) {
        return std::make_unique<MixedRig>(populated, seed, traits, rtl_ticks);
    }
    return std::make_unique<RtlRig>(populated, seed, traits);
}

} // namespace bridge_sim
