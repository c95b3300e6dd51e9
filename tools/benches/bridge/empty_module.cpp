// Clock cycles of the empty module per processor second, one evaluation a cycle as the simulated bridge has it.
#include <cstdio>
#include <ctime>

#include "Vempty.h"
#include "Vempty___024root.h"

void Vempty___024root___eval_nba(Vempty___024root *root); // no header of Verilator's has it

int main()
{
    Vempty top;
    top.clk = 0;
    top.eval();
    const clock_t begin = clock();
    for (long i = 0; i < CYCLES; i++) {
        top.in = i & 1;
        top.rootp->__VnbaTriggered[0] = 1;
        Vempty___024root___eval_nba(top.rootp);
    }
    std::printf("%.0f\n", CYCLES / (static_cast<double>(clock() - begin) / CLOCKS_PER_SEC));
    return 0;
}
