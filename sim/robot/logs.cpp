#include "logs.h"

#include <chrono>
#include <cinttypes>

namespace bridge_sim
{

namespace
{

constexpr double MM_PER_M = 1000;
constexpr size_t CELLS = 256; // characters that a row's numbers or a tip's cells can take

} // namespace

TruthLog::TruthLog(const std::string &path, const sim_scene &scene)
    : scene_(scene), travelled_m_(scene.whiskers), file_(path, header())
{
}

std::string TruthLog::header() const
{
    std::string text = "tick,x_m,y_m,theta_rad";
    for (size_t lane = 0; lane < scene_.whiskers; lane++) {
        const std::string name = scene_.whisker[lane].name;
        if (scene_.whisker[lane].role == SIM_TEXTURE_WHISKER) {
            text += "," + name + "_tile," + name + "_inside_mm," + name + "_moved_mm";
        }
    }
    return text;
}

void TruthLog::row(uint64_t tick, const sim_world *world)
{
    const sim_pose pose = sim_scene_on_map(&scene_, sim_world_pose(world));
    char text[CELLS];
    std::snprintf(text, sizeof text, "%" PRIu64 ",%.6f,%.6f,%.6f", tick, pose.x, pose.y, pose.theta);
    std::string cells = text;
    for (size_t lane = 0; lane < scene_.whiskers; lane++) {
        if (scene_.whisker[lane].role == SIM_TEXTURE_WHISKER) {
            cells += tip(lane, sim_world_tip(world, lane));
        }
    }
    file_.row(cells);
}

std::string TruthLog::tip(size_t lane, const sim_tip &tip)
{
    char text[CELLS];
    const double moved_m = tip.travelled_m - travelled_m_[lane];
    travelled_m_[lane] = tip.travelled_m;
    std::snprintf(text, sizeof text, ",%s,%.3f,%.3f", scene_.texture[tip.texture], MM_PER_M * tip.inside_m,
                  MM_PER_M * moved_m);
    return text;
}

void TruthLog::close()
{
    file_.close();
}

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
