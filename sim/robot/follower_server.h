// The socket by which readers of the ring hold the simulation back and the pilot drives the robot. One ASCII message
// per packet (Unix SOCK_SEQPACKET):
//   in:  follow NAME | taken T | pilot | drive T V OMEGA | unplug | plug | watch | dead LANE | well LANE
//   out: odometry T X Y THETA (to the pilot) | truth T X Y THETA (to who watches: nobody waits for him) | end N (to
//   all)
// With a Create for a base, whose driver has a port of its own, instead of drive and odometry:
//   in:  base T N: this answers the block that ends with tick T; the driver had written N bytes to the port by then
//   out: base T N (to the pilot, after every block): N bytes have been written to the port for the driver to read
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include <poll.h>
#include <sys/stat.h>

#include "pilot_answers.h"
extern "C" {
#include "sim_world.h"
}

namespace bridge_sim
{

constexpr uint64_t TAKEN_WINDOW = 4096; // ticks a follower may lag behind

// What a connection that is no follower may do to the cable, at once.
enum class Cable { UNPLUG, PLUG };

// A lane whose sensor falls silent, or answers again, from the next tick on.
struct LaneChange {
    size_t lane;
    bool dead;
};

class FollowerServer
{
  public:
    // Listens at path (empty: nobody follows) and expects this many followers, the pilot among them.
    // Throws std::runtime_error with one line if it cannot.
    FollowerServer(const std::string &path, unsigned expected, Answer answer);
    ~FollowerServer();
    FollowerServer(const FollowerServer &) = delete;
    FollowerServer &operator=(const FollowerServer &) = delete;

    // File descriptors to wait on.
    void add_to(std::vector<pollfd> &descriptors) const;

    // Accepts connections and reads every message there is. Throws std::runtime_error on a message that is not in the
    // list above or out of turn, and when the pilot leaves before the end.
    void receive();

    // May this tick be produced? Everyone is there, nobody lags, and the pilot has answered what takes effect by then.
    bool allows(uint64_t tick) const;

    // Does simulated time go by what a pilot answers?
    bool in_step() const;

    // The pilot's command that takes effect at this tick, if one does.
    std::optional<Drive> drive_at(uint64_t tick);

    // How many of the bytes that the base's driver wrote have taken effect at this tick; none without a pilot: then
    // they act as they come.
    std::optional<uint64_t> bytes_at(uint64_t tick);

    // The next thing asked of the cable, if any.
    std::optional<Cable> take_cable();

    // The next thing asked of a sensor, if any.
    std::optional<LaneChange> take_lane_change();

    void send_odometry(uint64_t tick, double x_m, double y_m, double theta_rad);
    void send_base(uint64_t tick, uint64_t bytes);
    void send_truth(uint64_t tick, const sim_pose &pose);
    void send_end(uint64_t ticks);

  private:
    struct Follower {
        int descriptor;
        std::string name; // empty: has not introduced itself
        bool pilot = false;
        bool watching = false;
        uint64_t taken = 0; // ticks processed
    };

    void accept_all();
    bool read_all(Follower &follower);
    void handle(Follower &follower, const std::string &message);
    void handle_answer(Follower &follower, const std::string &message);
    void leave(const Follower &follower);
    void send(const Follower &follower, const std::string &message);
    const Follower *pilot() const;

    std::string path_;
    unsigned expected_;
    PilotAnswers answers_;
    int listener_ = -1;
    struct stat made_ {
    }; // the socket, to know it again
    std::vector<Follower> followers_;
    std::deque<Cable> cable_;
    std::deque<LaneChange> lane_changes_;
    bool over_ = false;
};

} // namespace bridge_sim
