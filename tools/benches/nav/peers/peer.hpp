// What a native peer is: a filter that takes motions and weighs poses by this project's likelihood. Everything else,
// from the scene's numbers to the times, is here, so that all peers read and report alike.
#pragma once

#include <array>
#include <memory>
#include <random>
#include <string>
#include <vector>

extern "C" {
#include "weigh.h"
}

namespace peer
{

struct Scene {
    nav_problem problem{};
    std::vector<std::uint8_t> floor;
    std::vector<nav_box> boxes;
    std::vector<nav_tip> tips;
    std::vector<nav_ray> rays;
    std::vector<std::vector<double>> rows; // t_s, odometry[3], texture[tips][classes], radial_m[rays]
};

struct Motion {
    nav_pose step;             // m, rad, in the robot's frame before it
    double sigma_m, sigma_rad; // per axis; of the heading
};

using Options = std::vector<std::string>;

// The number after `--name`, or the default.
double option(const Options &, const std::string &name, double standard);
std::string option(const Options &, const std::string &name, const std::string &standard);

// Log-likelihood of the present row at poses.
class Likelihood
{
  public:
    explicit Likelihood(const nav_problem &);
    ~Likelihood();
    Likelihood(const Likelihood &) = delete;
    Likelihood &operator=(const Likelihood &) = delete;
    bool take(const nav_row &, Motion &);
    double at(double x, double y, double theta) const; // not below LEAST
    double ceiling() const;
    static constexpr double LEAST = -700.0; // where the robot cannot stand

  private:
    nav_weigher *weigher_;
};

// A pose drawn from the scene's prior, from its free part if it can be found.
nav_pose draw_prior(const nav_problem &, std::mt19937_64 &);
nav_pose draw_anywhere(const nav_problem &, std::mt19937_64 &);

class Filter
{
  public:
    virtual ~Filter() = default;
    virtual void step(const Motion &, bool news) = 0; // news: the likelihood speaks for this row
    virtual nav_pose estimate() = 0;
};

using Factory = std::unique_ptr<Filter> (*)(const Scene &, const Likelihood &, const Options &);

// main(): PROGRAM SCENE.txt EST.csv [--name value ...]; writes EST.csv with the CPU time of every step.
int run(int argc, char **argv, Factory);

} // namespace peer
