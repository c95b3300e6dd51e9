// MRPT's Monte-Carlo localisation (libmrpt-slam, BSD-3) with this project's likelihood in place of its maps.
//
//   mrpt_peer SCENE.txt EST.csv [--particles N] [--algorithm standard|auxiliary|optimal] [--kld MOST] [--seed S]
#include <mrpt/bayes/CParticleFilter.h>
#include <mrpt/maps/CSimplePointsMap.h>
#include <mrpt/obs/CActionCollection.h>
#include <mrpt/obs/CActionRobotMovement2D.h>
#include <mrpt/obs/CSensoryFrame.h>
#include <mrpt/poses/CPosePDFGaussian.h>
#include <mrpt/random.h>
#include <mrpt/slam/CMonteCarloLocalization2D.h>

#include "peer.hpp"

namespace
{

using mrpt::bayes::CParticleFilter;

class Cloud : public mrpt::slam::CMonteCarloLocalization2D
{
  public:
    Cloud(std::size_t count, const peer::Likelihood &likelihood)
        : CMonteCarloLocalization2D(count), likelihood_(likelihood)
    {
        options.metricMap = mrpt::maps::CSimplePointsMap::Create(); // asked for, never read
    }

    double PF_SLAM_computeObservationLikelihoodForParticle(const CParticleFilter::TParticleFilterOptions &,
                                                           const std::size_t, const mrpt::obs::CSensoryFrame &,
                                                           const mrpt::poses::CPose3D &pose) const override
    {
        return likelihood_.at(pose.x(), pose.y(), pose.yaw());
    }

  private:
    const peer::Likelihood &likelihood_;
};

class Mrpt : public peer::Filter
{
  public:
    Mrpt(const peer::Scene &scene, const peer::Likelihood &likelihood, const peer::Options &options)
        : cloud_(static_cast<std::size_t>(peer::option(options, "particles", 500.0)), likelihood)
    {
        const auto seed = static_cast<unsigned>(peer::option(options, "seed", 0.0));
        const double most = peer::option(options, "kld", 0.0);
        const std::string algorithm = peer::option(options, "algorithm", std::string("standard"));
        mrpt::random::getRandomGenerator().randomize(seed);
        std::mt19937_64 random(seed);
        for (auto &particle : cloud_.m_particles) {
            const nav_pose pose = peer::draw_prior(scene.problem, random);
            particle.d = mrpt::math::TPose2D(pose.x, pose.y, pose.theta);
            particle.log_w = 0.0;
        }
        auto &o = filter_.m_options;
        // MRPT draws a changing number of particles by the multinomial scheme alone.
        o.resamplingMethod = most > 0.0 ? CParticleFilter::prMultinomial : CParticleFilter::prSystematic;
        o.PF_algorithm = algorithm == "auxiliary" ? CParticleFilter::pfAuxiliaryPFStandard
                         : algorithm == "optimal" ? CParticleFilter::pfAuxiliaryPFOptimal
                                                  : CParticleFilter::pfStandardProposal;
        o.sampleSize = static_cast<unsigned>(cloud_.m_particles.size());
        o.adaptiveSampleSize = most > 0.0;
        if (o.adaptiveSampleSize) {
            auto &kld = cloud_.options.KLD_params; // widest bins, error and least number of host/nav/filter/particle.c
            kld.KLD_binSize_XY = NAV_NEAR_M / 5.0;
            kld.KLD_binSize_PHI = NAV_NEAR_RAD / 3.0;
            kld.KLD_epsilon = 0.05;
            kld.KLD_minSampleSize = 300;
            kld.KLD_maxSampleSize = static_cast<unsigned>(most);
        }
    }

    void step(const peer::Motion &motion, bool news) override
    {
        mrpt::obs::CActionRobotMovement2D move;
        mrpt::math::CMatrixDouble33 covariance;
        covariance.setZero();
        covariance(0, 0) = covariance(1, 1) = motion.sigma_m * motion.sigma_m + 1e-12;
        covariance(2, 2) = motion.sigma_rad * motion.sigma_rad + 1e-12;
        move.poseChange = mrpt::poses::CPosePDFGaussian::Create(
            mrpt::poses::CPose2D(motion.step.x, motion.step.y, motion.step.theta), covariance);
        mrpt::obs::CActionCollection actions;
        actions.insert(move);
        filter_.executeOn(cloud_, &actions, news ? &nothing_ : nullptr);
        since_ = news ? mrpt::poses::CPose2D() : since_ + move.poseChange->getMeanVal();
    }

    // MRPT keeps motions back until something is observed.
    nav_pose estimate() override
    {
        const mrpt::poses::CPose2D mean = cloud_.getMeanVal() + since_;
        return {mean.x(), mean.y(), mean.phi()};
    }

  private:
    Cloud cloud_;
    CParticleFilter filter_;
    mrpt::obs::CSensoryFrame nothing_;
    mrpt::poses::CPose2D since_;
};

} // namespace

int main(int argc, char **argv)
{
    return peer::run(argc, argv,
                     [](const peer::Scene &scene, const peer::Likelihood &likelihood,
                        const peer::Options &options) -> std::unique_ptr<peer::Filter> {
                         return std::make_unique<Mrpt>(scene, likelihood, options);
                     });
}
