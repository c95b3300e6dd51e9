// The Create of whisker-bridge-sim's command line: --create and the options of sim/create, each with "create-" before
// it.
#pragma once

#include <string>
#include <vector>

#include <getopt.h>

extern "C" {
#include "sim_create.h"
}

namespace bridge_sim
{

struct CreateOptions {
    bool on = false;
    std::string link; // where the pseudo-terminal is linked
    sim_create_options robot = sim_create_defaults(CREATE_OI_V2);
};

constexpr int CREATE_FIRST = 1000; // getopt's values of these options begin here

// The options, without getopt's end of the list.
std::vector<option> create_long_options();

// Sets the option of this value; text is null for a flag. Throws std::runtime_error with one line.
void set_create_option(CreateOptions &options, int value, const char *text);

} // namespace bridge_sim
