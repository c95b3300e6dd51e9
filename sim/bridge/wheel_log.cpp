#include "wheel_log.h"

#include <chrono>
#include <cinttypes>

namespace bridge_sim
{

namespace
{

constexpr size_t ROW_BYTES = 128;

} // namespace

WheelLog::WheelLog(const std::string &path) : file_(path, "tick,monotonic_s,v_m_s,omega_rad_s")
{
}

void WheelLog::note(uint64_t tick, const Drive &drive)
{
    if (drive.v_m_s == last_.v_m_s && drive.omega_rad_s == last_.omega_rad_s) {
        return;
    }
    last_ = drive;
    const double now_s = std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
    char text[ROW_BYTES];
    std::snprintf(text, sizeof text, "%" PRIu64 ",%.6f,%.4f,%.4f", tick, now_s, drive.v_m_s, drive.omega_rad_s);
    file_.row(text);
    file_.flush();
}

void WheelLog::close()
{
    file_.close();
}

} // namespace bridge_sim
