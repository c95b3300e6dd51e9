"""The whole robot maps an arena that it does not know, then finds itself in its own map from another start.

python -m crunchbot_lab.demo.mapping --out build/demo-map --build-dir build/release --seed 1

Both runs are of real firmware and gateware, as the demo's. The first drives to floor that its map does not have yet
(`--choose map`), the second at random. Leaves in the folder: `explore` (the first run, with the bag), `map` (what
the mapper wrote, a scene that `whisker localise` takes), `again` (the second run), summary.json and report.html.
"""

import argparse
import json
import shutil
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from crunchbot import scene as scenes
from crunchbot.nav import localise
from crunchbot.nav.scoring import lock_row
from crunchbot.occupancy import to_map
from crunchbot.outputs import made
from crunchbot.robot.policy import MAP

from ..report import map_page
from ..scenes import map_scoring
from ..scenes.map_reading import map_frame, read_map_folder
from ..simulation.scenes import draw_start
from .__main__ import (
    add_run_options,
    add_truth,
    chain_of,
    fresh_folder,
    guarded,
    learn_models,
    levels_told,
    make_scene,
    read_dicts,
    read_poses,
    seconds_of_rows,
    simulate,
    write_summary,
    write_world,
)

FILTERS = ("adaptive",)
SECONDS, AGAIN_S = 300.0, 60.0


def parse(argv: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m crunchbot_lab.demo.mapping", description=__doc__.splitlines()[0])
    add_run_options(parser, Path("build/demo-map"), SECONDS)
    parser.add_argument(
        "--again", type=seconds_of_rows, default=AGAIN_S, help="simulated, of the second run (%(default)s)"
    )
    parser.add_argument(
        "--level", choices=("mixed", "rtl", "bytes"), default="mixed", help="of the bridge, as the demo's (%(default)s)"
    )
    return parser.parse_args(argv)


def main(argv: list[str] | None = None) -> int:
    return guarded("demo-map", demonstrate, parse(argv))


def demonstrate(options: argparse.Namespace) -> dict:
    """All steps in order; leaves summary.json and report.html in the output folder, and returns the summary."""
    began, out = time.monotonic(), fresh_folder(options.out.resolve())
    scene, start = make_scene(options.seed, options.mechanics)
    results = {"seed": options.seed, "simulated_s": options.seconds, "again_s": options.again, "lanes": options.lanes}
    explore = folder_of(out / "explore", scene, start)
    learn_models(explore, scene, options)
    first = chain_of(explore, options, options.level, map_folder=out / "map", choose=MAP)
    results["explore"] = simulate(first)
    results["map"] = judge_map(out, scene)
    again = folder_of(out / "again", scene, draw_start(scene.arena, np.random.default_rng([options.seed, 2])))
    with made(again / "models", own=("*",)) as models:
        shutil.copytree(explore / "models", models)
    known = known_scene(out / "known", scenes.load(out / "map"))
    second = argparse.Namespace(**vars(options) | {"seconds": options.again, "seed": options.seed + 1})
    results["again"] = simulate(chain_of(again, second, options.level, filters=FILTERS, known=known))
    results["own"] = judge_again(out, scene, map_scoring.Motion(*results["map"]["motion"]))
    results["wall_s"] = time.monotonic() - began
    write_summary(out, results)
    report_lines(results)
    print(f"level: {levels_told(json.loads((explore / 'speed.json').read_text())['rtl_ticks'])}")
    print(map_page.write_report(out))
    return results


def folder_of(path: Path, scene: scenes.Scene, start: tuple[float, float, float]) -> Path:
    """A folder for a run of this scene from this true start."""
    path.mkdir()
    write_world(path / "scene", scene, start)
    return path


def known_scene(path: Path, mapped: scenes.Scene) -> Path:
    """The folder of the map as a navigator is given it that knows nothing of its start."""
    scenes.write(path, replace(mapped, prior=scenes.Prior("uniform")))
    return path


def truth_of(folder: Path) -> np.ndarray:
    """(n, 3) true poses at the rows of a run, which are put beside its observations, too."""
    truth = read_dicts(folder / "truth.csv")
    add_truth(localise.observations_path(folder / "scene"), truth)
    return np.array([[float(row[name]) for name in ("x_m", "y_m", "theta_rad")] for row in truth])


def judge_map(out: Path, scene: scenes.Scene) -> dict:
    """How good the map is (`map_scoring`), and the motion that brings the map's frame onto the arena's."""
    explore = out / "explore"
    truth = truth_of(explore)
    rows = localise.read_observations(localise.observations_path(explore / "scene"), scene)
    mapped, cells = read_map_folder(out / "map", scene, rows)
    motion = map_scoring.best_motion(mapped.table["pose"][:, :2], truth[:, :2])
    reported = json.loads((explore / "mapper.json").read_text())
    return {
        **map_scoring.judged(mapped, scene.arena),
        **map_scoring.cells_score(cells, motion, scene.arena),
        "motion": [motion.turn, motion.x, motion.y],
        "driven_m": float(np.hypot(*np.diff(truth[:, :2], axis=0).T).sum()),
        "rows": len(truth),
        "rows_missed": reported["missed"],
        "faces": reported["faces"],
        "tiles": reported["tiles"],
    }


def judge_again(out: Path, scene: scenes.Scene, motion: map_scoring.Motion) -> dict:
    """How the second run went in the map of the first: errors in the true arena, onto which the first run's motion brings
    the map; no motion of its own."""
    again, mapped = out / "again", scenes.load(out / "map")
    truth, poses = truth_of(again), read_poses(again / "est_adaptive.csv")
    frame = map_frame(mapped)
    error = np.hypot(*(motion.points(to_map(poses, frame)[:, :2]) - truth[:, :2]).T)
    locked = lock_row(error)
    after = error if locked is None else error[locked:]
    return {
        "rows": len(truth),
        "rows_to_lock": locked,
        "error_median_m": float(np.median(after)),
        "error_p90_m": float(np.quantile(after, 0.9)),
        "tiles_known": sum(letter != scenes.NOT_KNOWN for row in mapped.arena.floor for letter in row),
    }


def report_lines(s: dict) -> None:
    """Lines a person can read."""
    m, own = s["map"], s["own"]
    print(
        f"chain: {s['explore']['frames_received']} of {s['explore']['frames_sent']} frames, {m['rows_missed']} of "
        f"{m['rows']} rows missed by the mapper; {m['driven_m']:.0f} m driven in {s['simulated_s']:g} s"
    )
    print(
        f"map:   pose {_mm(m['error_median_m'])} mm median error ({_mm(m['anchored_median_m'])} from the first pose; "
        f"odometry {_mm(m['odometry_error_median_m'])}); {m['faces']} faces, {_percent(m['faces_right'])} of their length right; "
        f"{m['tiles']} tiles, {_percent(m['tiles_right'])} of the visited places right; "
        f"{_percent(m['free_right'])} of the free cells right"
    )
    found = "not locked" if own["rows_to_lock"] is None else f"locked after {0.1 * own['rows_to_lock']:.1f} s"
    print(f"own map: start unknown, {found}, then {_mm(own['error_median_m'])} mm median error in {s['again_s']:g} s")


def _mm(metres: float) -> str:
    return f"{1000 * metres:.0f}"


def _percent(share: float | None) -> str:
    return "none" if share is None else f"{100 * share:.0f} %"


if __name__ == "__main__":
    sys.exit(main())
