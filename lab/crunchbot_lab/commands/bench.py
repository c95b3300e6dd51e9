"""`whisker bench`: scores any engine's estimates on a fixed list of scenes and logs (crunchbot_lab.scenes.benchmark)."""

import argparse
import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from crunchbot.arguments import add_action, whole_number
from crunchbot.errors import UserError
from crunchbot.nav import localise, mapping
from crunchbot.nav.estimates import read_estimates
from crunchbot.nav.judging import NEAR_M, bits_reported, bits_wanted, judge, starts_of, travel_of
from crunchbot.nav.mapper import PARTICLES_MOST
from crunchbot.nav.observations import Observations, observations_path, read_observations
from crunchbot.nav.scoring import position_errors
from crunchbot.scene import Scene, load
from crunchbot.tables import TableError, unwritable

from ..scenes import benchmark, map_scoring, own_map, write_scene
from ..scenes.making import make
from ..scenes.map_reading import read_map_folder

EXAMPLE = "whisker bench touch --scene anchor+global --filter adaptive"
MAP_EXAMPLE = "whisker bench map --scene anchor --seed 7 --rows 600"
MAP_ROWS = 3000
COLUMNS = (  # title, key of the figure, factor, format
    ("near %", "near_share", 100, "5.1f"),
    ("after 20 cm %", "near_share_after_20cm", 100, "5.1f"),
    ("median mm", "error_median_m", 1000, ".1f"),
    ("in 90 % region", "coverage_90", 100, ".0f"),
    ("sure and wrong %", "sure_wrong_share", 100, ".1f"),
    ("Brier", "brier", 1, ".3f"),
    ("rows to lock", "rows_to_lock", 1, ".0f"),
    ("us a row", "step_us_mean", 1, ".3g"),
)


MAP_COLUMNS = (
    ("error mm", "error_median_m", 1000, ".1f"),
    ("90 % mm", "error_p90_m", 1000, ".1f"),
    ("from first pose mm", "anchored_median_m", 1000, ".1f"),
    ("in 90 % region", "coverage_90", 100, ".0f"),
    ("faces right %", "faces_right", 100, ".0f"),
    ("corners found %", "corners_found", 100, ".0f"),
    ("false %", "corners_false", 100, ".0f"),
    ("tiles said %", "tiles_said", 100, ".0f"),
    ("right %", "tiles_right", 100, ".1f"),
    ("solid cells right %", "solid_right", 100, ".0f"),
    ("free right %", "free_right", 100, ".0f"),
)


def add(parser: argparse.ArgumentParser) -> None:
    actions = parser.add_subparsers(dest="action", required=True, metavar="ACTION")
    p = add_action(actions, "touch", "where the robot is, by touch", EXAMPLE, touch)
    p.add_argument("--list", action="store_true", help="print the scenes of the list and leave")
    p.add_argument("--scene", metavar="NAME", help="a scene of the list, or a scene folder with true poses")
    p.add_argument("--data", metavar="DIR", help="folder of the logs, as DIR/thymio/random_1")
    p.add_argument("--estimate", metavar="EST.CSV", help="x_m, y_m, theta_rad, as in docs/formats.md, of any engine")
    text = "run this one of whisker's filters in place of --estimate"
    p.add_argument("--filter", metavar="NAME", choices=localise.filter_names(), help=text)
    p.add_argument("--out", metavar="DIR", help="write the scene's folder, for an engine of your own to run on")
    p.add_argument(
        "--near", type=_metres, default=NEAR_M, metavar="M", help="a row is near within so much (default: %(default)s)"
    )
    p.add_argument("--chart", metavar="FILE.svg", help="draw error and bits over the way, as SVG or PNG")
    p.add_argument(
        "--peers", type=Path, default=benchmark.STORED, metavar="FILE", help="stored figures of other engines"
    )
    p.add_argument("--json", action="store_true", help="print the scores as one line of JSON")

    _add_map(actions)


def _metres(text: str) -> float:
    value = float(text)
    if not 0.0 < value <= 100.0:
        raise ValueError
    return value


class BenchError(UserError):
    """What a command line lacks; one line."""


def touch(arguments: argparse.Namespace) -> int:
    if arguments.list:
        print("\n".join(benchmark.NAMES))
        return 0
    if arguments.scene is None:
        raise BenchError("bench touch: needs --scene; see --list, or name a scene folder")
    wanted = benchmark.entry(arguments.scene, arguments.data)
    if arguments.out:
        try:
            write_scene(arguments.out, wanted.scene, wanted.observations)
        except OSError as error:
            raise unwritable(arguments.out, error) from error
        print(f"{arguments.out}: {wanted.name}, {len(wanted.observations)} rows")
        return 0
    mine = _estimates(arguments, wanted)
    scores = [_judged(one, wanted, arguments.near) for one in (mine, *wanted.beside)]
    if arguments.chart:
        _draw(arguments.chart, wanted, (mine, *wanted.beside), arguments.near)
    peers = [] if arguments.near != NEAR_M else benchmark.stored(arguments.peers).get(wanted.name, [])
    reported = [*scores, *(score for score in peers if score["engine"] != mine.name)]
    print(json.dumps({"scene": wanted.name, "scores": reported}) if arguments.json else table(wanted.name, reported))
    return 0


def _estimates(arguments, wanted: benchmark.Entry):
    if (arguments.estimate is None) == (arguments.filter is None):
        raise BenchError("bench touch: needs --estimate or --filter, one of them; or --out to write the scene")
    if arguments.filter:
        return benchmark.run_filter(arguments.filter, wanted)
    return read_estimates(arguments.estimate, Path(arguments.estimate).stem, wanted.observations)


def _judged(estimates, wanted: benchmark.Entry, near_m: float) -> dict:
    try:
        return judge(estimates, wanted.observations, near_m)
    except ValueError as error:
        raise TableError(wanted.name, None, str(error)) from error


def table(scene: str, scores: list[dict]) -> str:
    """One line an engine; a dash for what it does not report."""
    width = max(len(scene), *(len(score["engine"]) for score in scores))
    lines = [" | ".join([f"{scene:{width}}", *(title for title, *_ in COLUMNS)])]
    for score in scores:
        cells = [_cell(score.get(key), factor, form, len(title)) for title, key, factor, form in COLUMNS]
        lines.append(" | ".join([f"{score['engine']:{width}}", *cells]))
    return "\n".join(lines)


def _cell(value: float | None, factor: float, form: str, width: int) -> str:
    return f"{'-' if value is None else format(factor * value, form):>{width}}"


def _draw(path: str, wanted: benchmark.Entry, engines, near_m: float) -> None:
    from ..report import touch_chart

    try:
        touch_chart.save(path, course(wanted, engines, near_m))
    except OSError as error:
        raise unwritable(path, error) from error
    except ValueError as error:
        raise BenchError(f"--chart {path}: {error}; name a file .svg or .png") from error


def course(wanted: benchmark.Entry, engines: Sequence[Any], near_m: float) -> Any:
    """What the chart draws of some engines' estimates of one scene."""
    from ..report.touch_chart import Course

    scene, rows = wanted.scene, wanted.observations
    errors = {e.name: (e.rows, position_errors(e.poses, rows.truth[e.rows])) for e in engines}
    travel, (x, y) = travel_of(rows, starts_of(rows)), scene.arena.size_m
    return Course(wanted.name, travel, x * y, near_m, bits_wanted(scene, near_m), bits_reported(scene, rows), errors)


def _add_map(actions: Any) -> None:
    p = add_action(actions, "map", "a map by touch alone, and the poses that it was made with", MAP_EXAMPLE, map_score)
    text = (
        "a family of scenes (see whisker scene make --list), or a scene folder with true poses (default: %(default)s)"
    )
    p.add_argument("--scene", default="anchor", metavar="NAME", help=text)
    text = "judge what these folders hold, of any SLAM, in place of whisker map: est.csv, and map.yaml, faces.csv, arena.toml"
    p.add_argument("maps", nargs="*", metavar="MAP", help=text)
    p.add_argument("--seed", type=whole_number(0), default=1, help="of a family's scene (default: %(default)s)")
    p.add_argument("--rows", type=whole_number(1), default=MAP_ROWS, help="of a family's scene (default: %(default)s)")
    text = (
        "judge these poses, in the frame of the first one, of any engine (docs/formats.md), in place of whisker map's"
    )
    p.add_argument("--estimate", metavar="EST.CSV", help=text)
    p.add_argument("--particles", type=whole_number(1, PARTICLES_MOST), metavar="N", help="as whisker map's")
    p.add_argument(
        "--own", action="store_true", help="locate another drive in the map that was made, beside the true one"
    )
    p.add_argument("--out", metavar="DIR", help="write the scene's folder, for an engine of your own to run on")
    p.add_argument("--json", action="store_true", help="print the scores as one line of JSON")


def map_score(arguments: argparse.Namespace) -> int:
    scene, rows = _map_scene(arguments)
    if arguments.out:
        try:
            write_scene(arguments.out, scene, rows)
        except OSError as error:
            raise unwritable(arguments.out, error) from error
        print(f"{arguments.out}: {arguments.scene}, {len(rows)} rows")
        return 0
    if rows.truth is None or not np.isfinite(rows.truth).all():
        raise BenchError(f"bench map: {arguments.scene} has rows without true poses; give a scene that has them all")
    if arguments.maps:
        found = {name: _map_of_others(name, scene, rows) for name in arguments.maps}
        print(json.dumps(found) if arguments.json else map_table(found))
        return 0
    found = _map_scores(arguments, scene, rows)
    lines = (f"{key}: {'-' if value is None else f'{value:.4g}'}" for key, value in found.items())
    print(json.dumps(found) if arguments.json else "\n".join(lines))
    return 0


def _map_of_others(folder: str, scene: Scene, rows: Observations) -> dict[str, float | None]:
    mapped, cells = read_map_folder(folder, scene, rows)
    found = map_scoring.judged(mapped, scene.arena)
    if not len(mapped.touched.faces):
        found["corners_found"] = None
    if cells is None:
        return found | dict.fromkeys(("solid_right", "free_right"))
    motion = map_scoring.best_motion(mapped.table["pose"][:, :2], rows.truth[:, :2])
    return found | map_scoring.cells_score(cells, motion, scene.arena)


def map_table(found: dict[str, dict[str, float | None]]) -> str:
    """One line a folder, and one of the odometry alone; a dash for what a folder does not hold."""
    width = max(len(name) for name in (*found, "odometry"))
    wheels = {key: value for key, value in next(iter(found.values())).items() if key.startswith("odometry_")}
    lines = [" | ".join([" " * width, *(title for title, *_ in MAP_COLUMNS)])]
    for name, one in (found | {"odometry": {key.removeprefix("odometry_"): v for key, v in wheels.items()}}).items():
        cells = (_cell(one.get(key), factor, form, len(title)) for title, key, factor, form in MAP_COLUMNS)
        lines.append(" | ".join([f"{name:{width}}", *cells]))
    return "\n".join(lines)


def _map_scene(arguments: argparse.Namespace) -> tuple[Scene, Observations]:
    if Path(arguments.scene).is_dir():
        scene = load(arguments.scene)
        return scene, read_observations(observations_path(arguments.scene), scene)
    made = make(arguments.scene, arguments.seed, arguments.rows)
    return made.scene, made.observations


def _map_scores(arguments: argparse.Namespace, scene: Scene, rows: Observations) -> dict[str, float | None]:
    if arguments.estimate:
        mine = read_estimates(arguments.estimate, Path(arguments.estimate).stem, rows)
        beside = map_scoring.trajectory(map_scoring.odometry_path(rows.odometry), rows.truth)
        found = map_scoring.trajectory(mine.poses, rows.truth[mine.rows])
        return found | {f"odometry_{key}": value for key, value in beside.items()}
    robot, textures = replace(scene.robot, sensors=()), scene.arena.textures
    mapped = mapping.run(robot, textures, rows, particles=arguments.particles, quiet=arguments.json)
    found = map_scoring.score(mapped, scene.arena)
    found |= {"parts": float(len(mapped.parts)), "parts_joined": float(sum(p.joined is not None for p in mapped.parts))}
    return found | (_own(mapped, arguments) if arguments.own else {})


def _own(mapped: mapping.Mapped, arguments: argparse.Namespace) -> dict[str, float | None]:
    """A drive in the map that was made, and the same in the true one."""
    if Path(arguments.scene).is_dir():
        raise BenchError(
            f"bench map --own: {arguments.scene} is a folder; name a family, which more drives are drawn of"
        )
    found: dict[str, float | None] = {}
    for drive in own_map.score(mapped, arguments.scene, arguments.seed):
        for name, located in (("own", drive.own), ("true", drive.true)):
            found |= {f"{name}_map_rows_to_lock": located.rows_to_lock, f"{name}_map_error_m": located.error_m}
    return found
