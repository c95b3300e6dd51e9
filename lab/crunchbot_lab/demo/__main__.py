"""The whole chain in one command: python -m crunchbot_lab.demo --out build/demo --build-dir build/release --seed 1."""

import argparse
import csv
import json
import multiprocessing
import os
import sys
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from tqdm import tqdm

from crunchbot import scene as scenes
from crunchbot.arguments import whole_number
from crunchbot.nav import localise
from crunchbot.outputs import made, opened, put
from crunchbot.stopping import interrupt_on_signals
from crunchbot.tables import TableError

from ..report import origin, write_report
from ..report.run import FILTERS
from ..simulation.scenes import MECHANICS, make_scene
from . import summary as scores
from .chain import ChainError, ChainRun, SpiLink, run_chain
from .kept_models import learn_or_copy
from .study import study
from .training import METHODS, calibrations, learn, radial_scores, write_radial_points

TICKS_PER_S = 2000
MARK = "demo.txt"


def parse(argv: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m crunchbot_lab.demo", description=__doc__)
    add_run_options(parser, Path("build/demo"), 60.0)
    parser.add_argument(
        "--spread",
        type=whole_number(1),
        default=8,
        help="seeds from this one on that are replayed without bits (%(default)s)",
    )
    parser.add_argument(
        "--level",
        choices=("mixed", "rtl", "bytes"),
        default="mixed",
        help="of the bridge: every clock cycle (rtl), its bytes, or cycles for the first seconds and around faults; "
        "the same frames (%(default)s)",
    )
    return parser.parse_args(argv)


def add_run_options(parser: argparse.ArgumentParser, out: Path, seconds: float) -> None:
    """What a run is asked for, whatever its length."""
    parser.add_argument("--out", type=Path, default=out, help="folder for everything the run leaves")
    parser.add_argument("--build-dir", type=Path, default=Path("build/release"))
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument(
        "--seconds", type=seconds_of_rows, default=seconds, help="simulated; a multiple of 0.1, at least 1"
    )
    parser.add_argument("--lanes", type=int, default=6, help="populated lanes, 6 to 28; those beyond 6 have no whisker")
    parser.add_argument(
        "--create", type=int, choices=(1, 2), default=1, help="the base: iRobot Create 1 or 2 (%(default)s)"
    )
    parser.add_argument("--mechanics", choices=MECHANICS, default=MECHANICS[0], help="how whiskers bend (%(default)s)")
    parser.add_argument("--texture", choices=METHODS, default=METHODS[0], help="texture classifier (%(default)s)")
    parser.add_argument("--sck-divider", type=int, default=6)
    parser.add_argument("--word-gap", type=int, default=30)
    parser.add_argument("--sample-point", type=int, default=5)


def seconds_of_rows(text: str) -> float:
    """A time that whole rows fill, as argparse wants it."""
    seconds = float(text)
    if seconds < 1.0 or abs(seconds * 10 - round(seconds * 10)) > 1e-9:
        raise argparse.ArgumentTypeError(f"{seconds:g}: give a multiple of 0.1, at least 1")
    return seconds


def main(argv: list[str] | None = None) -> int:
    return guarded("demo", demonstrate, parse(argv))


def guarded(name: str, job: Callable[[argparse.Namespace], object], options: argparse.Namespace) -> int:
    """Do a job; exit code 0, or a line about what is wrong and another code."""
    interrupt_on_signals()
    try:
        job(options)
    except (ChainError, scenes.SceneError, TableError, localise.SettingError) as error:
        print(f"{name}: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print(f"{name}: interrupted", file=sys.stderr)
        return 130
    return 0


def demonstrate(options: argparse.Namespace) -> None:
    """All steps in order; leaves summary.json and report.html in the output folder."""
    began = time.monotonic()
    out, scene, _ = prepare(options)
    results = {"seed": options.seed, "simulated_s": options.seconds, "lanes": options.lanes}
    results |= learn_models(out, scene, options)
    results |= run(out, options, options.level)
    results |= judge(out, scene)
    replay_seeds(out, scene, options)
    results["wall_s"] = time.monotonic() - began
    write_summary(out, results)
    report = write_report(out)
    tell(results)
    print(f"level: {levels_told(json.loads((out / 'speed.json').read_text())['rtl_ticks'])}")
    print(report)


def prepare(options: argparse.Namespace) -> tuple[Path, scenes.Scene, tuple[float, float, float]]:
    """The output folder with the scene in it, the scene, and the true start."""
    out = fresh_folder(options.out.resolve())
    scene, start = make_scene(options.seed, options.mechanics)
    write_world(out / "scene", scene, start)
    return out, scene, start


def write_world(path: Path, scene: scenes.Scene, start: tuple[float, float, float]) -> None:
    """The scene, with the text that the simulation takes and the true start in it."""
    with made(path, own=("*",)) as folder:
        scenes.write(folder, scene)
        put(folder / "scene.flat", scene.flat(start))


def replay_seeds(out: Path, scene: scenes.Scene, options: argparse.Namespace) -> None:
    """seeds.csv: median position errors in other arenas, of the same whiskers and models, at level 1; all processors at work."""
    seeds = range(options.seed, options.seed + options.spread)
    made = partial(
        study, seconds=options.seconds, models=out / "models", mechanics=options.mechanics, whiskers=scene.simulated
    )
    keys = {name: "pose_error_median_m" if name == "grid" else f"{name}_error_median_m" for name in FILTERS}
    workers = min(len(seeds), os.cpu_count() or 1)
    with ProcessPoolExecutor(workers, mp_context=multiprocessing.get_context("spawn")) as pool:
        found = list(tqdm(pool.map(made, seeds), "other seeds, signals", len(seeds), unit="seed"))
    rows = [
        {"seed": seed} | {f"{name}_m": of_seed[key] for name, key in keys.items()}
        for seed, of_seed in zip(seeds, found, strict=True)
    ]
    write_dicts(out / "seeds.csv", ["seed", *(f"{name}_m" for name in FILTERS)], rows)


def write_dicts(path: Path, header: list[str], rows: list[dict]) -> None:
    """A CSV file of rows by column."""
    with opened(path, True) as file:
        writer = csv.DictWriter(file, header, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def write_summary(out: Path, results: dict) -> None:
    """summary.json, with six decimals."""
    put(out / "summary.json", json.dumps(scores.rounded(results), indent=1) + "\n")


def fresh_folder(path: Path) -> Path:
    """An empty output folder; what an earlier demo left there is removed, anything else is not."""
    if path.exists() and not (path / MARK).exists() and any(path.iterdir()):
        raise ChainError(f"{path}: not empty, and not left by an earlier demo; choose another --out")
    with made(path, own=("*",)) as folder:
        folder.mkdir()
        put(folder / MARK, "Written by python -m crunchbot_lab.demo, which may remove this folder.\n")
        put(folder / "origin.json", json.dumps(origin.of_this_run(), indent=1) + "\n")
    return path


def learn_models(out: Path, scene: scenes.Scene, options: argparse.Namespace) -> dict:
    """Texture and radial models, from level-1 recordings, or copied if this robot has learnt them before."""
    with tqdm(total=1 + len(scene.robot.of_role("object")), desc="train and calibrate", unit="model") as bar:
        if options.texture == METHODS[0]:
            learn_or_copy(out / "models", scene, options.seed, bar.update)
        else:
            learn(out / "models", scene, options.seed, bar.update, options.texture)
    models, contacts = calibrations(out / "models")
    write_radial_points(out, models, contacts)
    return radial_scores(scene, models, contacts)


def run(out: Path, options: argparse.Namespace, level: str = "rtl") -> dict:
    """The chain at this level (chain.ChainRun); what was sent, received, spoilt and reported."""
    results = simulate(chain_of(out, options, level))
    links = (json.loads((out / f"{name}.json").read_text()) for name in ("pilot", "navigator"))
    return results | scores.link_scores(*links)


def chain_of(out: Path, options: argparse.Namespace, level: str, **more: Any) -> ChainRun:
    """The chain of these options in this folder; `more`: other fields of ChainRun."""
    link, build = SpiLink(options.sck_divider, options.word_gap, options.sample_point), options.build_dir.resolve()
    return ChainRun(out, build, options.seed, options.seconds, options.lanes, link, options.create, level, **more)


def simulate(chain: ChainRun) -> dict:
    """Runs it with its progress shown; what became of frames and faults."""
    out, ticks = chain.out, round(chain.seconds * TICKS_PER_S)
    with tqdm(total=ticks, desc=f"the whole robot, {chain.level.upper()}", unit="tick") as bar:
        wall_s = run_chain(chain, lambda tick: bar.update(tick - bar.n))
        bar.update(ticks - bar.n)
    speed = json.loads((out / "speed.json").read_text())
    log = json.loads((out / "log.json").read_text())
    return {
        "chain_wall_s": wall_s,
        "frames_sent": speed["ticks"],
        "frames_received": log["frames_received"],
        "frames_lost": speed["ticks"] - log["frames_received"],
        "usb_faults_injected": speed["usb_faults_injected"],
        **scores.fault_scores(out / "faults.csv", out / "bad.csv"),
    }


def judge(out: Path, scene: scenes.Scene) -> dict:
    """Compare what the pilot read and what the navigator thought with the truth."""
    path = localise.observations_path(out / "scene")
    truth = read_dicts(out / "truth.csv")
    add_truth(path, truth)
    observations = localise.read_observations(path, scene)
    poses = {name: read_poses(out / f"est_{name}.csv") for name in FILTERS}
    rows = [{key: float(value) if value else None for key, value in row.items()} for row in read_dicts(path)]
    return scores.texture_scores(rows, truth, scene) | scores.pose_scores(poses, observations.truth)


def read_dicts(path: Path) -> list[dict[str, str]]:
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def add_truth(path: Path, truth: list[dict[str, str]]) -> None:
    """Put the true pose beside each row of observations.csv, to score a filter with later."""
    rows = read_dicts(path)
    if len(rows) != len(truth):
        raise TableError(path, None, f"{len(rows)} rows but {len(truth)} true poses; see the logs beside it")
    names = ("x_m", "y_m", "theta_rad")
    with opened(path, True) as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([*rows[0], *(f"true_{name}" for name in names)])
        writer.writerows(
            [*row.values(), *(true[name] for name in names)] for row, true in zip(rows, truth, strict=True)
        )


def read_poses(path: Path) -> np.ndarray:
    """(n, 3) poses of an est.csv."""
    return np.loadtxt(path, delimiter=",", skiprows=1, usecols=(1, 2, 3), ndmin=2)


def tell(s: dict) -> None:
    """Three lines a person can read."""
    equal = "equal" if s["records_bad_match"] else "NOT EQUAL"
    std = np.array(list(s["radial_std_mm"].values()))
    print(
        f"chain: {s['frames_received']} of {s['frames_sent']} frames, {s['frames_lost']} lost; {s['records_bad_injected']} bad records "
        f"injected and {s['records_bad_reported']} reported, sets {equal}; {s['usb_faults_injected']} USB faults survived"
    )
    print(
        f"touch: texture {100 * s['texture_accuracy']:.1f} % of windows right; distance along the whisker to "
        f"{std.min():.1f}-{std.max():.1f} mm"
    )
    print(
        f"pose:  grid {1000 * s['pose_error_median_m']:.0f} mm median error, adaptive {1000 * s['adaptive_error_median_m']:.0f} mm, "
        f"foveal {1000 * s['foveal_error_median_m']:.0f} mm, odometry alone {1000 * s['odometry_error_median_m']:.0f} mm"
    )


def levels_told(rtl_ticks: list[int]) -> str:
    """Which level of detail made which simulated second, from the ticks at RTL of each."""
    whole = next((second for second, ticks in enumerate(rtl_ticks) if ticks < TICKS_PER_S), len(rtl_ticks))
    rest = rtl_ticks[whole:]
    if not rest:
        return f"all {whole} s at RTL, clock cycle by clock cycle"
    touched = sum(ticks > 0 for ticks in rest)
    return (
        f"the first {whole} s at RTL, clock cycle by clock cycle; then bytes, with RTL for {sum(rest)} ticks in {touched} "
        f"of {len(rest)} s, around faults and requests"
    )


if __name__ == "__main__":
    sys.exit(main())
