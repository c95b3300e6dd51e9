/*
 * C++: the default filter follows a robot in a room of four tiles, by the texture of the floor under one whisker and
 * the distance to the wall that another one touches. c++ -std=c++17 locate.cpp $(pkg-config --cflags --libs
 * whisker-nav) -o locate && ./locate
 *
 * Prints the last true and estimated poses; exits 1 when they are more than 10 cm apart.
 */
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filter.h>
#include <memory>
#include <vector>

namespace
{
constexpr double STEP_S = 0.1, SPEED_M_S = 0.1, TURN_RAD_S = 0.25;
constexpr int ROWS = 300;

struct Free {
    void operator()(nav_filter *filter) const
    {
        nav_filter_free(filter);
    }
};

/* A window of texture is right by a likelihood ratio of e^2. */
std::vector<double> texture_likelihoods(int texture, int textures)
{
    std::vector<double> log_likelihood(static_cast<std::size_t>(textures), -2.0);
    log_likelihood[static_cast<std::size_t>(texture)] = 0.0;
    return log_likelihood;
}
} // namespace

int main()
{
    const std::vector<std::uint8_t> floor = {0, 1, 1, 0}; /* textures of the tiles, from the lower left */
    const nav_tip tip = {0.1, 0.0};
    const nav_ray ray = {0.1, 0.0, 0.5, 0.3};
    nav_problem problem = {};
    problem.arena.size_x = problem.arena.size_y = 2.0;
    problem.arena.tile = 1.0;
    problem.arena.columns = problem.arena.rows = problem.arena.classes = 2;
    problem.arena.floor = floor.data();
    problem.robot.body_radius = 0.1;
    problem.robot.odometry_relative = 0.1;
    problem.robot.radial_sigma = 0.01;
    problem.robot.tips = problem.robot.rays = 1;
    problem.robot.tip = &tip;
    problem.robot.ray = &ray;
    problem.prior.mean = {1.5, 0.9, 1.2};
    problem.prior.sigma[0] = problem.prior.sigma[1] = problem.prior.sigma[2] = 0.2;
    nav_settings_default(&problem.settings);

    const std::unique_ptr<nav_filter, Free> filter(nav_filter_new("adaptive", &problem));
    if (!filter) {
        std::fprintf(stderr, "locate: no memory\n");
        return 1;
    }
    nav_pose truth = {1.45, 1.0, 1.5707963267948966};
    nav_estimate found = {};
    for (int k = 1; k <= ROWS; k++) {
        const double turn = TURN_RAD_S * STEP_S, forward = SPEED_M_S * STEP_S;
        truth.x += forward * std::cos(truth.theta);
        truth.y += forward * std::sin(truth.theta);
        truth.theta += turn;
        const double c = std::cos(truth.theta), s = std::sin(truth.theta);
        const auto texture = texture_likelihoods(
            nav_arena_texture(&problem.arena, truth.x + tip.x * c, truth.y + tip.x * s), problem.arena.classes);
        const double radial_m = nav_arena_range(&problem.arena, truth.x + ray.x * c, truth.y + ray.x * s,
                                                truth.theta + ray.yaw, ray.length);
        nav_row row = {};
        row.t_s = k * STEP_S;
        row.odometry[0] = 1.05 * forward; /* the wheels report 5 % too much */
        row.odometry[2] = turn;
        row.texture = texture.data();
        row.radial_m = &radial_m;
        nav_filter_step(filter.get(), &row, &found);
    }
    std::printf("at (%.2f, %.2f), found at (%.2f, %.2f), confidence %.2f\n", truth.x, truth.y, found.pose.x,
                found.pose.y, found.confidence);
    return std::hypot(found.pose.x - truth.x, found.pose.y - truth.y) < 0.1 ? 0 : 1;
}
