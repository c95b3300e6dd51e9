#include "follower_server.h"

#include <algorithm>
#include <cerrno>
#include <cinttypes>
#include <cstdio>
#include <cstring>
#include <stdexcept>

#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

namespace bridge_sim
{

namespace
{

constexpr int BACKLOG = 8;
constexpr size_t MESSAGE_BYTES = 256;

sockaddr_un address_of(const std::string &path)
{
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    if (path.size() >= sizeof address.sun_path) {
        throw std::runtime_error("--socket: '" + path + "' is too long for a Unix socket; use a shorter path");
    }
    std::memcpy(address.sun_path, path.c_str(), path.size());
    return address;
}

// Whether a socket of a program that has ended is there; one that lives refuses nobody, and no file is one.
bool is_left(const sockaddr_un &address)
{
    struct stat there;
    const int probe = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    const bool left = lstat(address.sun_path, &there) == 0 && S_ISSOCK(there.st_mode) &&
                      connect(probe, reinterpret_cast<const sockaddr *>(&address), sizeof address) != 0 &&
                      errno == ECONNREFUSED;
    close(probe);
    return left;
}

} // namespace

FollowerServer::FollowerServer(const std::string &path, unsigned expected, Answer answer)
    : path_(path), expected_(expected), answers_(answer)
{
    if (path.empty()) {
        return;
    }
    const sockaddr_un address = address_of(path);
    listener_ = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    if (is_left(address)) {
        unlink(path.c_str());
    }
    if (listener_ < 0 || bind(listener_, reinterpret_cast<const sockaddr *>(&address), sizeof address) != 0 ||
        lstat(path.c_str(), &made_) != 0 || listen(listener_, BACKLOG) != 0) {
        const std::string reason = std::strerror(errno);
        throw std::runtime_error("--socket: cannot listen at '" + path + "': " + reason);
    }
}

FollowerServer::~FollowerServer()
{
    for (const Follower &follower : followers_) {
        close(follower.descriptor);
    }
    if (listener_ >= 0) {
        close(listener_);
        struct stat there;
        if (lstat(path_.c_str(), &there) == 0 && there.st_dev == made_.st_dev && there.st_ino == made_.st_ino) {
            unlink(path_.c_str()); // what another has put there since stays
        }
    }
}

void FollowerServer::add_to(std::vector<pollfd> &descriptors) const
{
    if (listener_ >= 0) {
        descriptors.push_back({listener_, POLLIN, 0});
    }
    for (const Follower &follower : followers_) {
        descriptors.push_back({follower.descriptor, POLLIN, 0});
    }
}

// ---------------------------------------------------------------------------------------------------------- messages

void FollowerServer::accept_all()
{
    while (listener_ >= 0) {
        const int descriptor = accept4(listener_, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
        if (descriptor < 0) {
            return;
        }
        followers_.push_back({descriptor, "", false, false, 0});
    }
}

void FollowerServer::receive()
{
    accept_all();
    for (size_t i = 0; i < followers_.size();) {
        if (read_all(followers_[i])) {
            i++;
            continue;
        }
        const Follower gone = followers_[i];
        close(gone.descriptor);
        followers_.erase(followers_.begin() + static_cast<std::ptrdiff_t>(i));
        leave(gone);
    }
}

bool FollowerServer::read_all(Follower &follower)
{
    char buffer[MESSAGE_BYTES];
    for (;;) {
        const ssize_t count = recv(follower.descriptor, buffer, sizeof buffer, 0);
        if (count < 0 && (errno == EAGAIN || errno == EINTR)) {
            return true;
        }
        if (count <= 0) {
            return false;
        }
        handle(follower, std::string(buffer, static_cast<size_t>(count)));
    }
}

void FollowerServer::handle(Follower &follower, const std::string &message)
{
    uint64_t tick = 0;
    size_t lane = 0;
    char name[MESSAGE_BYTES] = "";
    if (std::sscanf(message.c_str(), "follow %255s", name) == 1) {
        follower.name = name;
    } else if (message == "pilot") {
        follower.name = "pilot";
        follower.pilot = true;
    } else if (std::sscanf(message.c_str(), "taken %" SCNu64, &tick) == 1) {
        follower.taken = std::max(follower.taken, tick + 1);
    } else if (message.compare(0, 6, "drive ") == 0 || message.compare(0, 5, "base ") == 0) {
        handle_answer(follower, message);
    } else if (message == "watch") {
        follower.watching = true;
    } else if (std::sscanf(message.c_str(), "dead %zu", &lane) == 1) {
        lane_changes_.push_back({lane, true});
    } else if (std::sscanf(message.c_str(), "well %zu", &lane) == 1) {
        lane_changes_.push_back({lane, false});
    } else if (message == "unplug" || message == "plug") {
        cable_.push_back(message == "plug" ? Cable::PLUG : Cable::UNPLUG);
    } else {
        throw std::runtime_error("socket: '" + message +
                                 "' is none of follow, taken, pilot, drive, base, unplug, plug, watch, dead, well");
    }
}

void FollowerServer::handle_answer(Follower &follower, const std::string &message)
{
    if (!follower.pilot || !answers_.take(message)) {
        throw std::runtime_error("socket: '" + message + "', but the pilot's answer due is " + answers_.due());
    }
    follower.taken = std::max(follower.taken, answers_.ticks_answered());
}

// A reader that leaves only stops being waited for; without its pilot the run cannot go on.
void FollowerServer::leave(const Follower &follower)
{
    if (over_ || follower.name.empty()) {
        return;
    }
    if (follower.pilot) {
        throw std::runtime_error("socket: the pilot left before the end of the run");
    }
    expected_ -= expected_ > 0 ? 1 : 0;
    std::fprintf(stderr, "whisker-bridge-sim: follower '%s' left\n", follower.name.c_str());
}

void FollowerServer::send(const Follower &follower, const std::string &message)
{
    if (::send(follower.descriptor, message.data(), message.size(), MSG_NOSIGNAL) < 0 && errno == EAGAIN) {
        throw std::runtime_error("socket: '" + follower.name + "' does not read its messages");
    }
}

std::optional<Cable> FollowerServer::take_cable()
{
    if (cable_.empty()) {
        return std::nullopt;
    }
    const Cable next = cable_.front();
    cable_.pop_front();
    return next;
}

std::optional<LaneChange> FollowerServer::take_lane_change()
{
    if (lane_changes_.empty()) {
        return std::nullopt;
    }
    const LaneChange next = lane_changes_.front();
    lane_changes_.pop_front();
    return next;
}

void FollowerServer::send_odometry(uint64_t tick, double x_m, double y_m, double theta_rad)
{
    if (const Follower *follower = pilot()) {
        char text[MESSAGE_BYTES];
        std::snprintf(text, sizeof text, "odometry %" PRIu64 " %.17g %.17g %.17g", tick, x_m, y_m, theta_rad);
        send(*follower, text);
    }
}

void FollowerServer::send_base(uint64_t tick, uint64_t bytes)
{
    const Follower *follower = pilot();
    if (follower && PilotAnswers::ends_block(tick)) {
        send(*follower, "base " + std::to_string(tick) + " " + std::to_string(bytes));
    }
}

void FollowerServer::send_truth(uint64_t tick, const sim_pose &pose)
{
    char text[MESSAGE_BYTES];
    std::snprintf(text, sizeof text, "truth %" PRIu64 " %.6f %.6f %.6f", tick, pose.x, pose.y, pose.theta);
    for (const Follower &follower : followers_) {
        if (follower.watching) {
            ::send(follower.descriptor, text, std::strlen(text), MSG_NOSIGNAL);
        }
    }
}

void FollowerServer::send_end(uint64_t ticks)
{
    over_ = true;
    for (const Follower &follower : followers_) {
        send(follower, "end " + std::to_string(ticks));
    }
}

// -------------------------------------------------------------------------------------------------------------- rules

const FollowerServer::Follower *FollowerServer::pilot() const
{
    const auto at = std::find_if(followers_.begin(), followers_.end(), [](const Follower &f) { return f.pilot; });
    return at == followers_.end() ? nullptr : &*at;
}

bool FollowerServer::in_step() const
{
    return pilot() != nullptr;
}

bool FollowerServer::allows(uint64_t tick) const
{
    const auto known = [](const Follower &follower) { return !follower.name.empty(); };
    const auto keeps_up = [&](const Follower &follower) {
        return !known(follower) || tick < follower.taken + TAKEN_WINDOW;
    };
    const auto here = std::count_if(followers_.begin(), followers_.end(), known);
    if (here < static_cast<std::ptrdiff_t>(expected_) || !std::all_of(followers_.begin(), followers_.end(), keeps_up)) {
        return false;
    }
    return !pilot() || answers_.cover(tick);
}

std::optional<Drive> FollowerServer::drive_at(uint64_t tick)
{
    return answers_.drive_at(tick);
}

std::optional<uint64_t> FollowerServer::bytes_at(uint64_t tick)
{
    return pilot() ? std::optional(answers_.bytes_at(tick)) : std::nullopt;
}

} // namespace bridge_sim
