"""The demo's exploration at level 1 on several seeds: the figures of navigation and texture in seconds, without bits.

python -m crunchbot_lab.demo.study --seeds 1 2 3
"""

import argparse
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from crunchbot.nav import localise
from crunchbot.observation import Row, has_normals
from crunchbot.pilot.pilot import Pilot
from crunchbot.robot.models import load_models
from crunchbot.scene import Scene

from ..report.run import FILTERS
from ..simulation.scenes import MECHANICS, SENSORS, make_scene
from .level1 import explore
from .summary import pose_scores, rounded, texture_scores
from .training import METHODS, learn, radial_scores


def study(
    seed: int,
    seconds: float,
    models: Path,
    mechanics: str = MECHANICS[0],
    whiskers: tuple[str, ...] | None = None,
    sensor: str = SENSORS[0],
) -> dict:
    """The navigation and texture figures of the summary for one seed, from a level-1 run with the models in a folder.

    whiskers: what the simulated world is given of them (`Scene.simulated`), if they are not the seed's own.
    """
    scene, start = make_scene(seed, mechanics, sensor)
    scene = scene if whiskers is None else replace(scene, simulated=whiskers)
    pilot = Pilot(scene.robot, *load_models(models, scene.robot), seed)
    rows, truth = explore(scene, start, pilot, seed, round(seconds * 2000))
    poses = np.array([[row[key] for key in ("x_m", "y_m", "theta_rad")] for row in truth])
    answers = {name: _localise(name, scene, rows) for name in FILTERS}
    scores = texture_scores(rows, truth, scene) | pose_scores(answers, poses)
    return rounded({"seed": seed, "simulated_s": seconds, "whisks": len(pilot.whisks)} | scores)


def _localise(name: str, scene: Scene, rows: list[Row]) -> np.ndarray:
    made = localise.Filter(name, scene, normals=has_normals(rows[0]))
    return np.array([made.step(row).pose for row in rows])


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m crunchbot_lab.demo.study", description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, nargs="+", required=True)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--mechanics", choices=MECHANICS, default=MECHANICS[0])
    parser.add_argument("--sensor", choices=SENSORS, default=SENSORS[0])
    parser.add_argument("--texture", choices=METHODS, default=METHODS[0])
    options = parser.parse_args(argv)
    print("seed  whisks  texture  grid (m)  90 % (m)  foveal (m)  odometry (m)  radial std / predicted")
    for seed in options.seeds:
        scene, _ = make_scene(seed, options.mechanics, options.sensor)
        with tempfile.TemporaryDirectory() as models:
            radial = radial_scores(scene, *learn(Path(models), scene, seed, lambda: None, options.texture))
            s = study(seed, options.seconds, Path(models), options.mechanics, sensor=options.sensor)
        ratios = [radial["radial_std_mm"][n] / p for n, p in radial["radial_std_predicted_mm"].items()]
        print(
            f"{seed:4d} {s['whisks']:7d} {s['texture_accuracy']:8.3f} {s['pose_error_median_m']:9.3f} "
            f"{s['pose_error_p90_m']:9.3f} {s['foveal_error_median_m']:11.3f} {s['odometry_error_median_m']:13.3f}  "
            + " ".join(f"{ratio:.2f}" for ratio in ratios),
            flush=True,
        )
    return 0


if __name__ == "__main__":
    sys.exit(main())
