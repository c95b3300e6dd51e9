// The command that runs beside the simulation and sees the device.
#pragma once

#include <string>
#include <vector>

#include <sys/types.h>

namespace bridge_sim
{

class Child
{
  public:
    // Starts it with default signal handling. It is killed when this object, or this process, ends before it.
    // Throws std::runtime_error with one line if it cannot be started.
    explicit Child(const std::vector<std::string> &command);
    ~Child();
    Child(const Child &) = delete;
    Child &operator=(const Child &) = delete;

    void ask_to_end(); // SIGTERM
    void kill();

    // Collects its end if there is one. Has it ended?
    bool ended();

    // After its end: its exit code, or 128 plus the signal that ended it, as a shell has it.
    int exit_code() const;

  private:
    pid_t pid_ = -1;
    bool ended_ = false;
    int exit_code_ = 0;
};

} // namespace bridge_sim
