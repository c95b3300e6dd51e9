#include "create_base.h"

#include <algorithm>
#include <stdexcept>

namespace bridge_sim
{

namespace
{

constexpr size_t CHUNK_BYTES = 512;
constexpr std::chrono::seconds PATIENCE{5}; // from a driver's write to a byte at the other end of the terminal

sim_create *make_create(const CreateOptions &options, uint64_t seed)
{
    sim_create_options robot = options.robot;
    robot.seed = seed;
    sim_create *create = sim_create_new(&robot);
    if (!create) {
        throw std::runtime_error("--create: no memory for it");
    }
    return create;
}

} // namespace

CreateBase::CreateBase(const CreateOptions &options, uint64_t seed, bool whole)
    : create_(make_create(options, seed)), whole_(whole)
{
    char error[CHUNK_BYTES] = "";
    if (create_pty_open(&pty_, options.link.c_str(), error, sizeof error) != 0) {
        sim_create_free(create_);
        throw std::runtime_error(std::string("--create-link: ") + error);
    }
}

CreateBase::~CreateBase()
{
    create_pty_close(&pty_);
    sim_create_free(create_);
}

void CreateBase::add_to(std::vector<pollfd> &descriptors) const
{
    descriptors.push_back({pty_.master, POLLIN, 0});
}

void CreateBase::receive()
{
    uint8_t bytes[CHUNK_BYTES];
    while (const size_t count = create_pty_read(&pty_, bytes, sizeof bytes)) {
        waiting_.insert(waiting_.end(), bytes, bytes + count);
    }
}

bool CreateBase::has(std::optional<uint64_t> written)
{
    const uint64_t come = handed_ + waiting_.size();
    if (!written || come >= *written) {
        waits_since_.reset();
        return true;
    }
    const auto now = std::chrono::steady_clock::now();
    if (now - waits_since_.value_or(now) > PATIENCE) {
        throw std::runtime_error("socket: the pilot reports " + std::to_string(*written) +
                                 " bytes written to the base's port, but only " + std::to_string(come) +
                                 " have come; report what the driver has written since the run began");
    }
    waits_since_ = waits_since_.value_or(now);
    return false;
}

void CreateBase::drive(sim_world *world, std::optional<uint64_t> written)
{
    const uint64_t up_to = written ? std::max(*written, handed_) - handed_ : waiting_.size();
    const size_t count = std::min(static_cast<size_t>(up_to), waiting_.size());
    sim_create_receive(create_, waiting_.data(), count);
    waiting_.erase(waiting_.begin(), waiting_.begin() + static_cast<std::ptrdiff_t>(count));
    handed_ += count;
    create_ground_drive(create_, world);
}

void CreateBase::tick(const sim_world *world)
{
    uint8_t bytes[CHUNK_BYTES];
    const size_t before = leaving_.size();
    create_ground_tick(create_, world);
    while (const size_t count = sim_create_take(create_, bytes, sizeof bytes)) {
        leaving_.insert(leaving_.end(), bytes, bytes + count);
    }
    if (!whole_ || leaving_.size() == before || leaving_.size() >= CHUNK_BYTES) {
        send();
    }
}

void CreateBase::send()
{
    if (!leaving_.empty()) {
        sent_ += create_pty_write(&pty_, leaving_.data(), leaving_.size());
        leaving_.clear();
    }
}

Drive CreateBase::speed() const
{
    Drive drive{};
    sim_create_speed(create_, &drive.v_m_s, &drive.omega_rad_s);
    return drive;
}

uint64_t CreateBase::sent() const
{
    return sent_;
}

} // namespace bridge_sim
