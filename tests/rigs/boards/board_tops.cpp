#include "Vcynthion_bench.h"
#include "Vcynthion_bench___024root.h"
#include "Vtang_bench.h"
#include "Vtang_bench___024root.h"
#include "Vusb3300_bench.h"
#include "Vusb3300_bench___024root.h"
#include "verilated_top.h"

namespace bridge_sim
{

std::unique_ptr<BoardTop> make_usb3300_board()
{
    return std::make_unique<VerilatedTop<Vusb3300_bench>>();
}

std::unique_ptr<BoardTop> make_cynthion()
{
    return std::make_unique<VerilatedTop<Vcynthion_bench>>();
}

std::unique_ptr<BoardTop> make_tang()
{
    return std::make_unique<VerilatedTop<Vtang_bench>>();
}

} // namespace bridge_sim
