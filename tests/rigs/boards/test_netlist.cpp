// The netlist that synthesis makes for a board with a USB3300, under the same trial as its source.
#include "cmocka_cpp.h"

#include "Vnetlist_bench.h"
#include "Vnetlist_bench___024root.h"
#include "board_device.h"
#include "trial.h"
#include "verilated_top.h"

using namespace bridge_sim;

namespace
{

const Kind NETLIST = {"netlist", BusSpeed::HIGH, false, false, [](NodeBus &nodes, const BoardFault &fault) {
                          return std::make_unique<BoardDevice>(std::make_unique<VerilatedTop<Vnetlist_bench>>(),
                                                               BoardTraits{{}, true}, nodes, fault);
                      }};

void the_netlist_enumerates_and_runs(void **)
{
    assert_string_equal(tried(NETLIST, {}, 4).c_str(), "");
}

void its_faults_are_noticed(void **)
{
    const BoardFault swapped = {BoardFault::Kind::SWAPPED, Wire::MISO, Wire::MISO, 3, 17};
    assert_string_not_equal(tried(NETLIST, swapped, 4).c_str(), "");
}

} // namespace

int main()
{
    const CMUnitTest tests[] = {
        cmocka_unit_test(the_netlist_enumerates_and_runs),
        cmocka_unit_test(its_faults_are_noticed),
    };
    return cmocka_run_group_tests(tests, nullptr, nullptr);
}
