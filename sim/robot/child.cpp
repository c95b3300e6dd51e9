#include "child.h"

#include <cerrno>
#include <csignal>
#include <cstring>
#include <stdexcept>

#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

namespace bridge_sim
{

namespace
{

constexpr int NOT_STARTED = 127;
constexpr int SIGNAL_BASE = 128;

[[noreturn]] void become(const std::vector<char *> &arguments)
{
    sigset_t none;
    sigemptyset(&none);
    sigprocmask(SIG_SETMASK, &none, nullptr);
    signal(SIGPIPE, SIG_DFL);
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    execvp(arguments[0], arguments.data());
    const std::string message =
        "whisker-bridge-sim: cannot run '" + std::string(arguments[0]) + "': " + std::strerror(errno) + "\n";
    const ssize_t written = write(STDERR_FILENO, message.data(), message.size());
    _exit(written < 0 ? NOT_STARTED - 1 : NOT_STARTED);
}

} // namespace

Child::Child(const std::vector<std::string> &command)
{
    std::vector<char *> arguments;
    for (const std::string &argument : command) {
        arguments.push_back(const_cast<char *>(argument.c_str())); // execvp does not write to them
    }
    arguments.push_back(nullptr);
    pid_ = fork();
    if (pid_ == 0) {
        become(arguments);
    }
    if (pid_ < 0) {
        throw std::runtime_error(std::string("cannot start the command: ") + std::strerror(errno));
    }
}

Child::~Child()
{
    if (!ended_) {
        kill();
        waitpid(pid_, nullptr, 0);
    }
}

void Child::ask_to_end()
{
    if (!ended_) {
        ::kill(pid_, SIGTERM);
    }
}

void Child::kill()
{
    if (!ended_) {
        ::kill(pid_, SIGKILL);
    }
}

bool Child::ended()
{
    int status = 0;
    if (!ended_ && waitpid(pid_, &status, WNOHANG) == pid_) {
        ended_ = true;
        exit_code_ = WIFEXITED(status) ? WEXITSTATUS(status) : SIGNAL_BASE + WTERMSIG(status);
    }
    return ended_;
}

int Child::exit_code() const
{
    return exit_code_;
}

} // namespace bridge_sim
