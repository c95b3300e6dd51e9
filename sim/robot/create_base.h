// The robot's base as a Create behind a serial port: the emulator on a pseudo-terminal, its wheels on the world's
// ground.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <vector>

#include <poll.h>

#include "options.h"
#include "pilot_answers.h"
extern "C" {
#include "create_ground.h"
#include "create_pty.h"
}

namespace bridge_sim
{

class CreateBase
{
  public:
    // Opens the port. Throws std::runtime_error with one line if it cannot. `whole`: bytes that leave without a pause
    // come to the port at once. A driver that goes by the wall's clock then finds no gap in a frame, however slow the
    // simulation.
    CreateBase(const CreateOptions &options, uint64_t seed, bool whole);
    ~CreateBase();
    CreateBase(const CreateBase &) = delete;
    CreateBase &operator=(const CreateBase &) = delete;

    void add_to(std::vector<pollfd> &descriptors) const;

    // Reads what the driver has written.
    void receive();

    // Have this many bytes come since the start? Whatever has come is enough if no number is given. Throws
    // std::runtime_error when the answer is no for too long: who counts them has written them already.
    bool has(std::optional<uint64_t> written);

    // Before a step of the world: the robot is handed the bytes up to this number, or all, and drives.
    void drive(sim_world *world, std::optional<uint64_t> written);

    // After it: its tick. What it sends is written to the port.
    void tick(const sim_world *world);

    // What its wheels are asked to do.
    Drive speed() const;

    // Bytes written to the port since the start.
    uint64_t sent() const;

  private:
    void send();

    sim_create *create_;
    bool whole_;
    create_pty pty_{};
    std::vector<uint8_t> waiting_; // come, but not handed to the robot
    std::vector<uint8_t> leaving_; // left the robot, but not written to the port
    uint64_t handed_ = 0;
    uint64_t sent_ = 0;
    std::optional<std::chrono::steady_clock::time_point> waits_since_; // for bytes that the pilot counts
};

} // namespace bridge_sim
