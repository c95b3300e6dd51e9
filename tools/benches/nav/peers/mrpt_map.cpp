// MRPT's Rao-Blackwellised particle filter with occupancy grids (libmrpt-slam, BSD-3) on rows of whiskers. Reads a run
// from the standard input and writes "x y theta us" of each row, as tools/benches/nav/map_peers.py describes both.
//
// MRPT's defaults but for the sensors' geometry: cells of 25 mm, beams as long as whiskers, one observation a whisker,
// a contact's standard deviation, none of the beams left out; and the odometry's noise and the distances between
// updates, which are meant for lasers of 80 m and would leave out nearly every contact.
#include <mrpt/maps/COccupancyGridMap2D.h>
#include <mrpt/obs/CActionCollection.h>
#include <mrpt/obs/CActionRobotMovement2D.h>
#include <mrpt/obs/CObservation2DRangeScan.h>
#include <mrpt/obs/CSensoryFrame.h>
#include <mrpt/random.h>
#include <mrpt/slam/CMetricMapBuilderRBPF.h>

#include <cmath>
#include <ctime>
#include <iostream>
#include <vector>

namespace
{

constexpr double CELL_M = 0.025, HALF_M = 4.0, STEP_M = 0.02, STEP_RAD = 0.1, APERTURE_RAD = 0.002;
constexpr std::size_t BEAMS = 2; // of a whisker, one in effect: MRPT takes no scan of one

struct Whisker {
    double x, y, yaw, length;
};

struct Run {
    std::size_t rows = 0, whiskers = 0, particles = 0;
    unsigned seed = 0;
    double sigma = 0.0, relative = 0.0, drift = 0.0;
};

double now_us()
{
    timespec t{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return 1e6 * static_cast<double>(t.tv_sec) + 1e-3 * static_cast<double>(t.tv_nsec);
}

mrpt::slam::CMetricMapBuilderRBPF::TConstructionOptions options(const Run &run, double reach)
{
    mrpt::slam::CMetricMapBuilderRBPF::TConstructionOptions o;
    mrpt::maps::COccupancyGridMap2D::TMapDefinition grid;
    grid.resolution = CELL_M;
    grid.min_x = grid.min_y = -HALF_M;
    grid.max_x = grid.max_y = HALF_M;
    grid.insertionOpts.maxDistanceInsertion = static_cast<float>(reach);
    grid.likelihoodOpts.LF_maxRange = static_cast<float>(reach);
    grid.likelihoodOpts.LF_stdHit = static_cast<float>(std::hypot(run.sigma, CELL_M / 2.0));
    grid.likelihoodOpts.LF_decimation = BEAMS;
    o.mapsInitializers.push_back(grid);
    o.insertionLinDistance = o.localizeLinDistance = static_cast<float>(STEP_M);
    o.insertionAngDistance = o.localizeAngDistance = static_cast<float>(STEP_RAD);
    o.PF_options.sampleSize = static_cast<unsigned>(run.particles);
    o.verbosity_level = mrpt::system::LVL_ERROR;
    return o;
}

mrpt::obs::CActionCollection moved(const Run &run, const mrpt::poses::CPose2D &step)
{
    mrpt::obs::CActionRobotMovement2D::TMotionModelOptions model;
    model.modelSelection = mrpt::obs::CActionRobotMovement2D::mmGaussian;
    model.gaussianModel.a1 = model.gaussianModel.a4 = run.relative;
    model.gaussianModel.a2 = 0.0;
    model.gaussianModel.a3 = run.drift;
    model.gaussianModel.minStdXY = model.gaussianModel.minStdPHI = 1e-4;
    mrpt::obs::CActionRobotMovement2D move;
    move.computeFromOdometry(step, model);
    mrpt::obs::CActionCollection action;
    action.insert(move);
    return action;
}

// distance: infinity where nothing was touched.
mrpt::obs::CObservation2DRangeScan::Ptr read(const Whisker &w, double distance)
{
    auto scan = mrpt::obs::CObservation2DRangeScan::Create();
    const bool touched = std::isfinite(distance);
    scan->aperture = APERTURE_RAD;
    scan->maxRange = static_cast<float>(w.length);
    scan->sensorPose = mrpt::poses::CPose3D(w.x, w.y, 0.0, w.yaw, 0.0, 0.0);
    scan->resizeScan(BEAMS);
    for (std::size_t beam = 0; beam < BEAMS; beam++) {
        scan->setScanRange(beam, static_cast<float>(touched ? distance : w.length));
        scan->setScanRangeValidity(beam, touched);
    }
    return scan;
}

int map(std::istream &in)
{
    Run run;
    in >> run.rows >> run.whiskers >> run.seed >> run.particles >> run.sigma >> run.relative >> run.drift;
    std::vector<Whisker> whisker(run.whiskers);
    double reach = 0.0;
    for (auto &w : whisker) {
        in >> w.x >> w.y >> w.yaw >> w.length;
        reach = std::max(reach, w.length);
    }
    mrpt::random::getRandomGenerator().randomize(run.seed);
    mrpt::slam::CMetricMapBuilderRBPF builder(options(run, reach));
    builder.initialize();
    for (std::size_t row = 0; row < run.rows; row++) {
        double dx = 0.0, dy = 0.0, turn = 0.0;
        std::string distance;
        in >> dx >> dy >> turn;
        mrpt::obs::CSensoryFrame frame;
        const double begun = now_us();
        for (const auto &w : whisker) {
            in >> distance;
            const double metres = std::stod(distance);
            if (!std::isnan(metres))
                frame.insert(read(w, metres));
        }
        if (!in)
            return 1;
        auto action = moved(run, {dx, dy, turn});
        builder.processActionObservation(action, frame);
        mrpt::poses::CPose3D pose;
        builder.getCurrentPoseEstimation()->getMean(pose);
        std::cout << pose.x() << ' ' << pose.y() << ' ' << pose.yaw() << ' ' << now_us() - begun << '\n';
    }
    return 0;
}

} // namespace

int main()
{
    try {
        std::cout.precision(9);
        return map(std::cin);
    } catch (const std::exception &error) {
        std::cerr << "mrpt_map: " << error.what() << '\n';
        return 1;
    }
}
