// Level bytes gives what the gateware gives: random scripts on both, every packet and every report compared.
// `test_levels SCRIPTS SEED` runs more of them.
#include "cmocka_cpp.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <map>

#include "level_script.h"

using namespace bridge_sim;

namespace
{

constexpr uint64_t SCRIPTS = 204;
constexpr uint64_t SEED = 1;
// Lanes with a node. Most scripts have few, for nodes take their time at both levels.
constexpr size_t POPULATED[] = {1, 3, 2, LANES, 1, 6};
constexpr uint64_t SCRIPTS_OF_RIG = 34;

uint64_t scripts = SCRIPTS;
uint64_t first_seed = SEED;

struct Seen {
    std::map<std::string, uint64_t> steps;
    uint64_t packets = 0, empty_packets = 0, refusals = 0;
};
Seen seen;

void add(const LevelScript &script, const LevelPair &pair)
{
    for (const auto &[name, count] : script.taken()) {
        seen.steps[name] += count;
    }
    seen.packets += pair.packets;
    seen.empty_packets += pair.empty_packets;
    seen.refusals += pair.stalls;
}

// Scripts on one pair follow each other, so that what one leaves behind meets the next.
void run_rig(uint64_t rig, uint64_t count)
{
    const size_t populated = POPULATED[rig % std::size(POPULATED)];
    const uint64_t seed = first_seed * 1000003 + rig;
    uint64_t script = 0;
    try {
        LevelPair pair(populated, seed);
        LevelScript steps(pair, populated, seed);
        for (; script < count; script++) {
            steps.run();
        }
        add(steps, pair);
    } catch (const std::exception &error) {
        fail_msg("seed %llu, rig %llu, script %llu: %s", static_cast<unsigned long long>(first_seed),
                 static_cast<unsigned long long>(rig), static_cast<unsigned long long>(script), error.what());
    }
}

void levels_agree(void **)
{
    for (uint64_t done = 0; done < scripts; done += SCRIPTS_OF_RIG) {
        run_rig(done / SCRIPTS_OF_RIG, std::min(SCRIPTS_OF_RIG, scripts - done));
    }
    for (const auto &[name, count] : seen.steps) {
        std::printf("%s: %llu, ", name.c_str(), static_cast<unsigned long long>(count));
    }
    std::printf("packets: %llu, of them empty: %llu, refusals: %llu\n", static_cast<unsigned long long>(seen.packets),
                static_cast<unsigned long long>(seen.empty_packets), static_cast<unsigned long long>(seen.refusals));
    if (scripts >= SCRIPTS) {
        assert_int_equal(seen.steps.size(), LevelScript::KINDS);
        assert_true(seen.packets > 0 && seen.empty_packets > 0 && seen.refusals > 0);
    }
}

// Each limit by itself, one step beyond it and on it; the random scripts meet some of them too seldom.
void limits_agree(void **)
{
    struct Change {
        size_t at;
        uint32_t beyond, within;
        bool wide;
    };
    static const Change CHANGES[] = {{WHISKER_REPORT_CONTROL_SCK_DIVIDER, 15, 14, false},
                                     {WHISKER_REPORT_CONTROL_SCK_DIVIDER, 34, 32, false},
                                     {WHISKER_REPORT_CONTROL_SAMPLE_POINT, 17, 16, false},
                                     {WHISKER_REPORT_CONTROL_SAMPLE_POINT, 0, 1, false},
                                     {WHISKER_REPORT_CONTROL_WORD_GAP, 29, 30, false},
                                     {WHISKER_REPORT_CONTROL_LANE_MASK, 1u << 28, 1u << 27, true},
                                     {WHISKER_REPORT_CONTROL_TICK_PERIOD, 3999, 4000, true}};
    LevelPair pair(1, first_seed);
    RequestSource source(first_seed);
    for (const Change &change : CHANGES) {
        HostRequest request = source.control(false);
        request.data[WHISKER_REPORT_CONTROL_SCK_DIVIDER] = 16;
        request.data[WHISKER_REPORT_CONTROL_SAMPLE_POINT] = 6;
        for (const uint32_t value : {change.beyond, change.within}) {
            if (change.wide) {
                whisker_put_u32(request.data.data() + change.at, value);
            } else {
                request.data[change.at] = static_cast<uint8_t>(value);
            }
            const Outcome expected = value == change.beyond ? Outcome::STALL : Outcome::OK;
            assert_int_equal(static_cast<int>(pair.control(request)), static_cast<int>(expected));
        }
    }
}

} // namespace

int main(int argc, char **argv)
{
    if (argc == 3) {
        scripts = std::strtoull(argv[1], nullptr, 10);
        first_seed = std::strtoull(argv[2], nullptr, 10);
    }
    const CMUnitTest tests[] = {cmocka_unit_test(limits_agree), cmocka_unit_test(levels_agree)};
    return cmocka_run_group_tests(tests, nullptr, nullptr);
}
