#include "peer.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <iterator>
#include <stdexcept>

namespace peer
{

namespace
{

// Numbers of a scene as peer_runs.py writes them, in their order.
class Numbers
{
  public:
    explicit Numbers(const std::string &path) : file_(path)
    {
    }
    double next()
    {
        std::string word;
        if (!(file_ >> word))
            throw std::runtime_error("the scene ends too early");
        return std::strtod(word.c_str(), nullptr);
    }
    int count()
    {
        return static_cast<int>(next());
    }

  private:
    std::ifstream file_;
};

void read_arena(Numbers &in, Scene &scene)
{
    nav_arena &a = scene.problem.arena;
    a.size_x = in.next();
    a.size_y = in.next();
    a.tile = in.next();
    a.columns = in.count();
    a.rows = in.count();
    a.classes = in.count();
    for (int n = 0; n < a.columns * a.rows; n++)
        scene.floor.push_back(static_cast<std::uint8_t>(in.count()));
    a.boxes = in.count();
    for (int n = 0; n < a.boxes; n++) {
        const double x0 = in.next(), y0 = in.next(), x1 = in.next(), y1 = in.next();
        scene.boxes.push_back({x0, y0, x1, y1});
    }
    a.floor = scene.floor.data();
    a.box = scene.boxes.data();
}

void read_robot(Numbers &in, Scene &scene)
{
    nav_robot &r = scene.problem.robot;
    r.body_radius = in.next();
    r.odometry_relative = in.next();
    r.radial_sigma = in.next();
    r.tips = in.count();
    for (int n = 0; n < r.tips; n++) {
        const double x = in.next(), y = in.next();
        scene.tips.push_back({x, y});
    }
    r.rays = in.count();
    for (int n = 0; n < r.rays; n++) {
        const double x = in.next(), y = in.next(), yaw = in.next(), length = in.next();
        scene.rays.push_back({x, y, yaw, length});
    }
    r.tip = scene.tips.data();
    r.ray = scene.rays.data();
}

void read_prior(Numbers &in, nav_prior &prior)
{
    prior.uniform = in.count() != 0;
    prior.mean.x = in.next();
    prior.mean.y = in.next();
    prior.mean.theta = in.next();
    for (double &sigma : prior.sigma)
        sigma = in.next();
}

// In place: the problem points into the scene's own arrays.
void read_scene(const std::string &path, Scene &scene)
{
    Numbers in(path);
    nav_settings_default(&scene.problem.settings);
    read_arena(in, scene);
    read_robot(in, scene);
    read_prior(in, scene.problem.prior);
    const int width = 4 + scene.problem.robot.tips * scene.problem.arena.classes + scene.problem.robot.rays;
    scene.rows.resize(static_cast<std::size_t>(in.count()));
    for (auto &row : scene.rows)
        for (int n = 0; n < width; n++)
            row.push_back(in.next());
}

nav_row row_of(const Scene &scene, const std::vector<double> &cells)
{
    nav_row row{};
    row.t_s = cells[0];
    std::copy_n(&cells[1], 3, row.odometry);
    row.texture = &cells[4];
    row.radial_m = cells.data() + 4 + scene.problem.robot.tips * scene.problem.arena.classes;
    return row;
}

double cpu_us()
{
    timespec now{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now); // every thread's: a peer may use several
    return static_cast<double>(now.tv_sec) * 1e6 + static_cast<double>(now.tv_nsec) * 1e-3;
}

void run_rows(const Scene &scene, Likelihood &likelihood, Filter &filter, std::FILE *out)
{
    std::fprintf(out, "x_m,y_m,theta_rad,step_us\n");
    for (const auto &cells : scene.rows) {
        const nav_row row = row_of(scene, cells);
        Motion motion{};
        const double began = cpu_us();
        const bool news = likelihood.take(row, motion);
        filter.step(motion, news);
        const nav_pose pose = filter.estimate();
        std::fprintf(out, "%.6f,%.6f,%.6f,%.3f\n", pose.x, pose.y, pose.theta, cpu_us() - began);
    }
}

} // namespace

std::string option(const Options &options, const std::string &name, const std::string &standard)
{
    const auto at = std::find(options.begin(), options.end(), "--" + name);
    return at == options.end() || at + 1 == options.end() ? standard : *(at + 1);
}

double option(const Options &options, const std::string &name, double standard)
{
    return std::strtod(option(options, name, std::to_string(standard)).c_str(), nullptr);
}

Likelihood::Likelihood(const nav_problem &problem) : weigher_(nav_weigher_new(&problem))
{
    if (!weigher_)
        throw std::bad_alloc();
}

Likelihood::~Likelihood()
{
    nav_weigher_free(weigher_);
}

bool Likelihood::take(const nav_row &row, Motion &motion)
{
    double moved[5];
    const bool news = nav_weigher_take(weigher_, &row, moved);
    motion = {{moved[0], moved[1], moved[2]}, moved[3], moved[4]};
    return news;
}

double Likelihood::at(double x, double y, double theta) const
{
    const double pose[3] = {x, y, theta};
    double loglik = 0.0;
    nav_weigher_weigh(weigher_, pose, 1, &loglik);
    return std::max(loglik, LEAST);
}

double Likelihood::ceiling() const
{
    return nav_weigher_ceiling(weigher_);
}

nav_pose draw_anywhere(const nav_problem &problem, std::mt19937_64 &random)
{
    std::uniform_real_distribution<double> share(0.0, 1.0);
    nav_pose pose{};
    for (int n = 0; n < 1000; n++) {
        pose = {share(random) * problem.arena.size_x, share(random) * problem.arena.size_y,
                (2.0 * share(random) - 1.0) * NAV_PI};
        if (nav_arena_free(&problem.arena, pose.x, pose.y, problem.robot.body_radius))
            break;
    }
    return pose;
}

nav_pose draw_prior(const nav_problem &problem, std::mt19937_64 &random)
{
    if (problem.prior.uniform)
        return draw_anywhere(problem, random);
    std::normal_distribution<double> normal;
    nav_pose pose{};
    for (int n = 0; n < 1000; n++) {
        pose = problem.prior.mean;
        pose.x += problem.prior.sigma[0] * normal(random);
        pose.y += problem.prior.sigma[1] * normal(random);
        pose.theta += problem.prior.sigma[2] * normal(random);
        if (nav_arena_free(&problem.arena, pose.x, pose.y, problem.robot.body_radius))
            break;
    }
    return pose;
}

int run(int argc, char **argv, Factory make)
{
    if (argc < 3) {
        std::fprintf(stderr, "%s: needs SCENE.txt and EST.csv\n", argv[0]);
        return 2;
    }
    try {
        Scene scene;
        read_scene(argv[1], scene);
        Likelihood likelihood(scene.problem);
        const std::unique_ptr<Filter> filter = make(scene, likelihood, Options(argv + 3, argv + argc));
        std::FILE *out = std::fopen(argv[2], "w");
        if (!out)
            throw std::runtime_error(std::string(argv[2]) + " cannot be written");
        run_rows(scene, likelihood, *filter, out);
        std::fclose(out);
    } catch (const std::exception &error) {
        std::fprintf(stderr, "%s: %s\n", argv[0], error.what());
        return 1;
    }
    return 0;
}

} // namespace peer
