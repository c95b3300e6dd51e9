"""Particle filters from Python packages on one scene, with this project's likelihood. Runs in the peers' venv.

python_peer.py PEER SCENE EST.csv --particles N --seed S: writes EST.csv with the CPU time of every step. What a package
does not bring (motion, mean) is vectorised NumPy, alike for all.
"""

import argparse
import time
import warnings
from collections.abc import Iterator

import numpy as np
from weigher import Weigher

from crunchbot.nav.observations import Observations, observations_path, read_observations
from crunchbot.scene import Prior, Scene, load

LEAST = -700.0  # log-likelihood where no robot can stand: packages differ in how they take infinities
TRIES = 50


def draw_prior(scene: Scene, count: int, rng: np.random.Generator) -> np.ndarray:
    """(count, 3) poses, redrawn while they are not free."""
    prior, size = scene.prior or Prior("uniform"), scene.arena.size_m

    def draw(n: int) -> np.ndarray:
        if prior.kind == "gaussian":
            return rng.normal(prior.mean, prior.sigma, (n, 3))
        return rng.uniform((0.0, 0.0, -np.pi), (*size, np.pi), (n, 3))

    poses = draw(count)
    for _ in range(TRIES):
        blocked = [not scene.arena.is_free(x, y, scene.robot.body_radius_m) for x, y, _ in poses]
        if not any(blocked):
            break
        poses[blocked] = draw(sum(blocked))
    return poses


def moved(poses: np.ndarray, motion, rng: np.random.Generator) -> np.ndarray:
    """Every pose one step on, with noise of its own."""
    cosine, sine = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    dx, dy, turn = motion.step
    noise = rng.normal(0.0, (motion.sigma_m, motion.sigma_m, motion.sigma_rad), poses.shape)
    return (
        poses + np.column_stack([cosine * dx - sine * dy, sine * dx + cosine * dy, np.full(len(poses), turn)]) + noise
    )


def mean(poses: np.ndarray, weights: np.ndarray) -> tuple[float, float, float]:
    x, y = weights @ poses[:, :2]
    return float(x), float(y), float(np.arctan2(weights @ np.sin(poses[:, 2]), weights @ np.cos(poses[:, 2])))


def normalised(log_weights: np.ndarray) -> np.ndarray:
    weights = np.exp(log_weights - log_weights.max())
    return weights / weights.sum()


def filterpy(scene: Scene, rows: Observations, count: int, rng: np.random.Generator) -> Iterator[tuple]:
    """As its documentation's particle filter: filterpy brings the resampling."""
    from filterpy.monte_carlo import systematic_resample

    weigher = Weigher(scene)
    poses, log_weights = draw_prior(scene, count, rng), np.zeros(count)
    for k in range(len(rows)):
        motion, news = weigher.take(rows, k)
        poses = moved(poses, motion, rng)
        if news:
            log_weights += np.maximum(weigher.weigh(poses), LEAST)
        weights = normalised(log_weights)
        yield mean(poses, weights)
        if 1.0 / np.sum(weights**2) < count / 2:
            poses, log_weights = poses[systematic_resample(weights)], np.zeros(count)


def particles(scene: Scene, rows: Observations, count: int, rng: np.random.Generator) -> Iterator[tuple]:
    """Chopin's package: a Feynman-Kac model run by its SMC, which draws from NumPy's global generator."""
    from particles import SMC, FeynmanKac

    weigher = Weigher(scene)

    class Model(FeynmanKac):
        def M0(self, N):
            return self.M(0, draw_prior(scene, N, rng))

        def M(self, t, xp):
            self.motion, self.news = weigher.take(rows, t)
            return moved(xp, self.motion, rng)

        def logG(self, t, xp, x):
            return np.maximum(weigher.weigh(x), LEAST) if self.news else np.zeros(len(x))

    np.random.seed(int(rng.integers(2**31)))
    smc = SMC(fk=Model(T=len(rows)), N=count, resampling="systematic", ESSrmin=0.5, collect="off")
    for _ in smc:
        yield mean(smc.X, smc.W)


def pfilter(scene: Scene, rows: Observations, count: int, rng: np.random.Generator) -> Iterator[tuple]:
    """pfilter draws from NumPy's global generator; it resamples below half the effective size here, too."""
    from pfilter import ParticleFilter, systematic_resample

    weigher = Weigher(scene)
    np.random.seed(int(rng.integers(2**31)))
    motion = None
    made = ParticleFilter(
        prior_fn=lambda n: draw_prior(scene, n, rng),
        observe_fn=lambda poses: np.maximum(weigher.weigh(poses), LEAST)[:, None],
        resample_fn=systematic_resample,
        n_particles=count,
        dynamics_fn=lambda poses: moved(poses, motion, rng),
        weight_fn=lambda loglik, _: np.exp(loglik[:, 0] - loglik.max()),
        n_eff_threshold=0.5,
    )
    for k in range(len(rows)):
        motion, news = weigher.take(rows, k)
        made.update(np.zeros(1) if news else None)
        yield mean(made.original_particles, made.original_weights)


PEERS = {"filterpy": filterpy, "particles": particles, "pfilter": pfilter}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("peer", choices=PEERS)
    parser.add_argument("scene")
    parser.add_argument("out")
    parser.add_argument("--particles", type=int, default=500)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    warnings.simplefilter("ignore")  # a collapsed cloud divides by nothing, row after row
    scene = load(options.scene)
    rows = read_observations(observations_path(options.scene), scene)
    steps = PEERS[options.peer](scene, rows, options.particles, np.random.default_rng(options.seed))
    lines = ["x_m,y_m,theta_rad,step_us"]
    for _ in range(len(rows)):
        began = time.process_time_ns()
        x, y, theta = next(steps)
        lines.append(f"{x:.6f},{y:.6f},{theta:.6f},{(time.process_time_ns() - began) / 1000:.3f}")
    with open(options.out, "w") as file:
        file.write("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
