#include "create_options.h"

#include <deque>
#include <stdexcept>

namespace bridge_sim
{

namespace
{

constexpr size_t MESSAGE_BYTES = 512;

enum Own { MODEL, LINK, OWN };

int version_of(const std::string &model)
{
    if (model != "1" && model != "2") {
        throw std::runtime_error("--create '" + model + "': give 1 or 2");
    }
    return model == "1" ? CREATE_OI_V2 : CREATE_OI_V3;
}

// The names with "create-" before them, made once: getopt keeps pointers to them.
const std::deque<std::string> &robot_names()
{
    static const std::deque<std::string> names = [] {
        std::deque<std::string> made;
        const char *name = nullptr;
        const char *value = nullptr;
        const char *help = nullptr;
        for (size_t i = 0; sim_create_describe(i, &name, &value, &help); i++) {
            made.push_back(std::string("create-") + name);
        }
        return made;
    }();
    return names;
}

} // namespace

std::vector<option> create_long_options()
{
    std::vector<option> options = {{"create", required_argument, nullptr, CREATE_FIRST + MODEL},
                                   {"create-link", required_argument, nullptr, CREATE_FIRST + LINK}};
    const char *name = nullptr;
    const char *value = nullptr;
    const char *help = nullptr;
    for (size_t i = 0; sim_create_describe(i, &name, &value, &help); i++) {
        const int argument = value ? required_argument : no_argument;
        options.push_back({robot_names()[i].c_str(), argument, nullptr, CREATE_FIRST + OWN + static_cast<int>(i)});
    }
    return options;
}

void set_create_option(CreateOptions &options, int value, const char *text)
{
    char error[MESSAGE_BYTES] = "";
    const char *name = nullptr;
    const char *value_name = nullptr;
    const char *help = nullptr;
    if (value == CREATE_FIRST + MODEL) {
        options.robot.version = version_of(text);
        options.on = true;
    } else if (value == CREATE_FIRST + LINK) {
        options.link = text;
    } else if (!sim_create_describe(static_cast<size_t>(value - CREATE_FIRST - OWN), &name, &value_name, &help) ||
               sim_create_set(&options.robot, name, text, error, sizeof error) != 0) {
        throw std::runtime_error(std::string("--create-") + error);
    }
}

} // namespace bridge_sim
