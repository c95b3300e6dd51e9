"""Other projects' SLAM on the same rows of touch, and on laser logs whose beams are cut to a whisker's length.

.venv/bin/python tools/benches map_peers [--seeds N] [--log CARMEN_LOG ...]

MRPT's Rao-Blackwellised particle filter is built where libmrpt-slam-dev is installed. Any other program joins by
MAP_PEER_<NAME>=PROGRAM (GMapping's proposal: MAP_PEER_GMAPPING). It reads from its standard input

    ROWS WHISKERS SEED PARTICLES SIGMA_M ODOMETRY_RELATIVE DRIFT_RAD
    X_M Y_M YAW_RAD LENGTH_M                      of each whisker's base, robot frame
    DX_M DY_M TURN_RAD DISTANCE_M ...             of each row; inf: touches nothing, nan: not read

and writes X_M Y_M THETA_RAD CPU_US of each row, the first pose about the origin. What cannot be had is left out with its
own error. --log: corrected logs in CARMEN's format, odometry in ODOM, true poses in FLASER; none comes with the project.
"""

import argparse
import math
import os
import subprocess
from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path

import matplotlib
import numpy as np

from crunchbot.nav import mapping
from crunchbot.nav.observations import Observations
from crunchbot.occupancy import from_map
from crunchbot.scene import Robot
from crunchbot_lab.scenes import map_scoring
from crunchbot_lab.scenes.making import make
from crunchbot_lab.scenes.robots import rays
from crunchbot_lab.scenes.sweep import sweep

from .. import store
from ..markdown import table
from . import charts, peer_runs

FAMILIES = ("anchor", "robot", "raw", "noisy")
OURS, OUR_TITLE, OUR_LOOK = "faces", "faces and tiles", "o"
PEER_LOOKS = ("D", "v", "X", "P")
LIMITS_US, LIMITS_MM = (30.0, 3e4), (5.0, 3e3)  # of the chart, one scale for all families
PREFIX = "MAP_PEER_"
ROWS, FIRST_SEED, WORKERS, PARTICLES = 3000, 700, 1, 30
PROBE = 20  # rows that a peer is tried on
DRIFT_RAD = 0.02
CUTS_M, BEAMS, LOG_SIGMA_M, LOG_ODOMETRY = (0.3, 1.0), 19, 0.01, 0.1
STRETCH_M, STRETCH_ROWS, STRETCHES = 11.0, (60, 1500), 2  # from its first pose, at most; scans; of a log, at most
INPUTS = (
    *("host/nav", "host/python/crunchbot/nav", "lab/crunchbot_lab/scenes", "tools/benches/nav/peers"),
    "tools/benches/nav/map_peers.py",
)
Rows = tuple[Robot, tuple[str, ...], Observations]


@cache
def scene(family: str, seed: int) -> Rows:
    made = make(family, seed, ROWS)
    return made.scene.robot, made.scene.arena.textures, made.observations


def scans(path: Path) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of a log: ranges (n, beams), true poses (n, 3), poses by odometry at the same times (n, 3)."""
    wheels, ranges, truth = [], [], []
    try:
        lines = path.read_text().splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise SystemExit(f"{path}: {error}; give --log a log in CARMEN's format") from error
    for lineno, line in enumerate(lines, 1):
        words = line.split()
        try:
            if words[:1] == ["ODOM"]:
                wheels.append([float(words[at]) for at in (7, 1, 2, 3)])
            elif words[:1] == ["FLASER"]:
                beams = int(words[1])
                truth.append([float(words[2 + beams + at]) for at in (0, 1, 2, 6)])
                ranges.append([float(word) for word in words[2 : 2 + beams]])
                if beams != len(ranges[0]):
                    raise ValueError(f"{beams} beams, {len(ranges[0])} before")
        except (ValueError, IndexError) as error:
            raise SystemExit(f"{path}:{lineno}: {words[0]}: {error}; give a log in CARMEN's format") from error
    if not wheels or not truth:
        raise SystemExit(f"{path}: no lines of ODOM and FLASER; give a corrected log in CARMEN's format")
    order = sorted(wheels)
    by_time, found = np.array(order), np.array(truth)
    turns = np.unwrap(by_time[:, 3])
    columns = (by_time[:, 1], by_time[:, 2], turns)
    return np.array(ranges), found[:, :3], np.column_stack([np.interp(found[:, 3], by_time[:, 0], c) for c in columns])


def stretches(truth: np.ndarray) -> Iterator[slice]:
    """Rows that stay near the first of them: the mappers' cells end at 12.8 m."""
    first, count = 0, 0
    while first < len(truth) and count < STRETCHES:
        far = np.hypot(*(truth[first:, :2] - truth[first, :2]).T) > STRETCH_M
        last = first + (int(np.argmax(far)) if far.any() else len(far))
        if min(last - first, STRETCH_ROWS[1]) >= STRETCH_ROWS[0]:
            yield slice(first, min(last, first + STRETCH_ROWS[1]))
            count += 1
        first = max(last, first + 1)


@cache
def clipped(path: Path, cut_m: float, stretch: int) -> Rows:
    """Rows of a stretch of a log, beams cut: a shorter one is a contact, a longer one touches nothing."""
    ranges, truth, wheels = scans(path)
    rows = list(stretches(truth))[stretch]
    kept = np.linspace(0, ranges.shape[1] - 1, BEAMS).round().astype(int)
    yaws = np.linspace(-math.pi / 2, math.pi / 2, ranges.shape[1])[kept]
    robot = Robot(0.1, LOG_ODOMETRY, LOG_SIGMA_M, rays(*((0.0, 0.0, yaw) for yaw in yaws), length_m=cut_m))
    short, path_by_wheels = ranges[rows][:, kept], wheels[rows]
    steps = [np.zeros(3)]
    for before, after in zip(path_by_wheels[:-1], path_by_wheels[1:], strict=True):
        steps.append(from_map(after[None], tuple(before))[0])
    t_s, none = 0.1 * np.arange(len(short)), np.zeros((len(short), 0, 1))
    text = [f"{t:.1f}" for t in t_s]
    radial = np.ascontiguousarray(np.where(short < cut_m, short, np.inf))
    return robot, ("NONE",), Observations(t_s, text, np.array(steps), none, radial, truth[rows])


def rows_text(rows: Rows, seed: int) -> str:
    """What a peer reads."""
    robot, _, seen = rows
    whiskers = robot.of_role("object")
    head = (len(seen), len(whiskers), seed, PARTICLES, robot.radial_sigma_m, robot.odometry_relative_sigma, DRIFT_RAD)
    lines = [*((*w.base_m, w.yaw_rad, w.length_m) for w in whiskers), *np.column_stack([seen.odometry, seen.radial_m])]
    numbers = "".join(" ".join(repr(float(v)) for v in line) + "\n" for line in lines)
    return f"{' '.join(map(str, head))}\n{numbers}"


def by_program(program: str, rows: Rows, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """(n, 3) poses and (n,) CPU time in us."""
    done = subprocess.run([program], input=rows_text(rows, seed), capture_output=True, text=True)
    lines = [line.split() for line in done.stdout.splitlines()]
    if done.returncode or len(lines) != len(rows[2]):
        error = (done.stderr.strip().splitlines() or ["no error given"])[-1]
        raise RuntimeError(f"{program}: {len(lines)} rows of {len(rows[2])}: {error}")
    found = np.array(lines, float)
    return found[:, :3], found[:, 3]


def programs(build: Path) -> dict[str, str]:
    """Peers that can be had: name -> program."""
    found = {key.removeprefix(PREFIX).lower(): value for key, value in os.environ.items() if key.startswith(PREFIX)}
    if mrpt := peer_runs.built(build, "mrpt_map"):
        found["mrpt"] = str(mrpt)
    if "gmapping" not in found:
        store.leave_out(
            "gmapping", f"no program; set {PREFIX}GMAPPING to one that tools/benches/nav/map_peers.py describes"
        )
    return {name: program for name, program in found.items() if _answers(name, program)}


def _answers(name: str, program: str) -> bool:
    """Whether a program answers a few rows; else it is left out with its error."""
    robot, textures, rows = scene(FAMILIES[0], FIRST_SEED)
    few = replace(rows, **{key: getattr(rows, key)[:PROBE] for key in ("t_s", "odometry", "radial_m")})
    try:
        by_program(program, (robot, textures, few), 0)
    except (OSError, RuntimeError, ValueError) as error:
        store.leave_out(name, str(error))
        return False
    return True


def one(name: str, program: str, world: tuple, seed: int) -> dict[str, float | str]:
    """Figures of one run, or the `error` of a peer; `world`: arguments of `scene` or of `clipped`."""
    rows = scene(*world) if len(world) == 2 else clipped(Path(world[0]), *world[1:])
    wheels = map_scoring.odometry_path(rows[2].odometry)
    if name == "odometry":
        poses, us = wheels, np.zeros(len(wheels))
    elif program:
        try:
            poses, us = by_program(program, rows, seed)
        except RuntimeError as error:
            return {"error": str(error)}
    else:
        run = mapping.run(*rows, seed)
        poses, us = run.table["pose"], run.step_us
    return {
        "error_median_m": map_scoring.trajectory(poses, rows[2].truth)["error_median_m"],
        "odometry_error_median_m": map_scoring.trajectory(wheels, rows[2].truth)["error_median_m"],
        "step_us_mean": float(us.mean()),
        "touched": float(np.isfinite(rows[2].radial_m).any(axis=1).mean()),
    }


def measure(build: Path, seeds: int, workers: int, logs: list[Path]) -> dict:
    peers = programs(build)
    worlds = {family: [(family, FIRST_SEED + n) for n in range(seeds)] for family in FAMILIES}
    for path in logs:
        count = len(list(stretches(scans(path)[1])))
        worlds |= {f"{path.stem}, {cut} m": [(str(path), cut, n) for n in range(count)] for cut in CUTS_M}
    jobs, parts = {}, {}
    for world, runs in worlds.items():
        for name in ("odometry", OURS, *peers):
            parts[name, world] = [f"{name}-{world}-{n}".replace(" ", "") for n in range(len(runs))]
            jobs |= {
                job: {"name": name, "program": peers.get(name, ""), "world": run, "seed": n}
                for n, (job, run) in enumerate(zip(parts[name, world], runs, strict=True))
            }
    found = sweep(one, jobs, store.kept("map_peers", *INPUTS), workers, label="map_peers")
    points = []
    for (name, world), names in parts.items():
        runs = [found[job] for job in names]
        if errors := [run["error"] for run in runs if "error" in run]:
            store.leave_out(f"{name}, {world}", errors[0])
            continue
        medians = {key: float(np.median([run[key] for run in runs])) for key in runs[0]}
        worst = max(run["error_median_m"] for run in runs)
        points.append({"mapper": name, "world": world, "runs": len(runs), "error_worst_m": worst, **medians})
    return {"rows": ROWS, "seeds": seeds, "particles": PARTICLES, "peers": sorted(peers), "points": points}


def chart(data: dict) -> matplotlib.figure.Figure:
    """Error against time for a row, a panel for each family."""
    figure, axes = charts.panels(len(FAMILIES))
    looks = {OURS: OUR_LOOK} | dict(zip(data["peers"], PEER_LOOKS, strict=False))
    for ax, family in zip(axes, FAMILIES, strict=True):
        points = {p["mapper"]: p for p in data["points"] if p["world"] == family}
        wheels = 1000 * points.pop("odometry")["error_median_m"]
        ax.axhline(wheels, color="0.5", linestyle=":", linewidth=0.8, label="odometry")
        for name, p in points.items():
            colours = {"color": "0.0"} if name == OURS else {"color": "0.35", "markerfacecolor": "white"}
            ax.plot(p["step_us_mean"], 1000 * p["error_median_m"], looks[name], label=_title(name), **colours)
        ax.set(xscale="log", yscale="log", xlim=LIMITS_US, ylim=LIMITS_MM, title=family)
        ax.set(xlabel="CPU time of a row, us", ylabel="median error, mm")
        ax.grid(True, linewidth=0.3)
    charts.legend_above(figure, axes)
    return figure


def _title(mapper: str) -> str:
    return OUR_TITLE if mapper == OURS else mapper


def _lines(points: list[dict], touched: bool) -> list[list[str]]:
    lines = []
    for p in points:
        cells = [f"{1000 * p[key]:.0f}" for key in ("error_median_m", "error_worst_m", "odometry_error_median_m")]
        cells += [f"{100 * p['touched']:.0f}"] if touched else []
        lines.append([p["world"], _title(p["mapper"]), str(p["runs"]), *cells, f"{p['step_us_mean']:.0f}"])
    return lines


def page(data: dict) -> str:
    """docs/results/map_peers.md."""
    head = ["family", "mapper", "runs", "error, mm", "worst, mm", "odometry, mm", "us a row"]
    drawn = [p for p in data["points"] if p["world"] in FAMILIES and p["mapper"] != "odometry"]
    logs = [p for p in data["points"] if p["world"] not in FAMILIES and p["mapper"] != "odometry"]
    text = (
        "# Other projects' SLAM on rows of touch\n\n"
        "Generated by `tools/benches page` from `bench/results/map_peers.json`, measured by `tools/benches map_peers`: "
        f"{data['rows']} rows a run, scenes a family: {data['seeds']}, the same for all. Errors are medians over a run's "
        "rows after the rigid motion that fits the path best, as `whisker bench map` has them, then medians over the "
        f"runs. Peers hold {data['particles']} particles, GMapping's default; they take distances and odometry, for they "
        "know no textures.\n\n"
        "Peers run with their own defaults but for what the sensor is: a beam a whisker, as long as it, from its base "
        "(MRPT) or from the robot's middle to its end (GMapping takes one centre), cells of 25 mm, MRPT's standard "
        "deviation of a contact, the robot's own odometry noise in MRPT. An update takes place every 2 cm or 0.1 rad; "
        "their defaults of 0.4 to 1 m are meant for lasers and would leave out nearly every contact. GMapping runs with "
        "its proposal by scan matching; where its program was measured, the likelihood was sampled 10 mm and 0.005 rad "
        "about the match.\n\n" + table(head, _lines(drawn, False)) + "\n"
        "![error against cost, our maps and peers](../charts/map_peers.svg)\n\n"
        "A scan is of a few beams as short as whiskers; between contacts a pose is the odometry's.\n"
    )
    if not logs:
        return text
    head = ["log, beams cut to", "mapper", "stretches", *head[3:6], "rows with a contact, %", head[6]]
    return (
        text + "\n## Laser logs, beams cut to a whisker's length\n\n"
        f"Corrected logs in CARMEN's format, of the user's own: {BEAMS} beams of each scan, longer ones touch nothing. "
        f"Stretches that stay within {STRETCH_M:.0f} m of their first pose, {STRETCH_ROWS[1]} scans at most, "
        f"{STRETCHES} a log at most. Odometry is of the log's ODOM lines, truth its corrected poses.\n\n"
        + table(head, _lines(logs, True))
        + "\nRobots with lasers keep off walls: what is cut to a whisker's length seldom touches anything.\n"
    )


def run(build: Path, seeds: int = 3, workers: int = WORKERS, log: list[Path] | None = None) -> None:
    data = measure(build, seeds, workers, log or [])
    store.write_result("map_peers", data)
    store.write_chart("map_peers", chart(data), letters=True)
    store.write_page(store.ROOT / "docs/results/map_peers.md", page(data))


def options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--seeds", type=int, default=3, help="scenes of each family (default: %(default)s)")
    parser.add_argument("--workers", type=int, default=WORKERS, help="processes (default: %(default)s)")
    parser.add_argument("--log", type=Path, action="append", metavar="FILE", help="a corrected log in CARMEN's format")
