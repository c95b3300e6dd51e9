"""The page of demo-map: the true arena beside the map, the run as a motion, and the robot in its own map."""

import json
import math
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from crunchbot.occupancy import to_map
from crunchbot.outputs import put
from crunchbot.recording.mcapfile import McapFile
from crunchbot.robot.network.messages import OccupancyGrid, TouchMap, decode
from crunchbot.scene import Scene, load
from crunchbot.view.maps import map_parts

from ..scenes.map_reading import map_frame
from ..scenes.map_scoring import Motion, best_motion, odometry_path
from . import figures
from .html import document, figure, pairs, percent, section, table, tiles
from .html import script as page_script
from .page import loss_table
from .run import read_columns

FRAME_S = 4.0  # between two maps of the motion
TOPICS = {"/map": OccupancyGrid, "/touch_map": TouchMap}
STYLES = {
    "mapper": ("mapper", {"color": "#0b5394", "linestyle": "-"}),
    "odometry": ("odometry alone, aligned too", {"color": "#6b6b6b", "linestyle": ":"}),
    "own map": ("in its own map", {"color": "#0b5394", "linestyle": "-"}),
}
LEGEND = """<ul class="keys" id="motion-textures"><li><i class="mark line"></i>pose, and where it was</li>
<li><i class="mark dashes"></i>robot as it really went</li><li><i class="mark block"></i>obstacle</li>
<li><i class="mark face"></i>face that was felt, ± 2 σ</li><li><i class="mark ring"></i>corner, 2 σ</li>
<li><i class="mark free"></i>free</li><li><i class="mark solid"></i>solid</li></ul>"""


@dataclass(frozen=True)
class MapRun:
    """What the demo left. Poses (n, 3) at times (n,): the first run's in the arena, by the one motion; truth; odometry alone,
    by a motion of its own; then the second run's. error_m: of each."""

    folder: Path
    summary: dict
    scene: Scene
    seconds: np.ndarray
    truth: np.ndarray
    poses: np.ndarray
    error_m: dict[str, np.ndarray]
    again_s: np.ndarray
    again_error_m: np.ndarray


def write_report(folder: Path) -> Path:
    """Read the runs in `folder` and write its report.html; returns the file's path."""
    path = folder / "report.html"
    put(path, render(read(folder)))
    return path


def read(folder: Path) -> MapRun:
    """The runs of a folder."""
    summary, scene = json.loads((folder / "summary.json").read_text()), load(folder / "explore/scene")
    seconds, truth = _truth(folder / "explore")
    again_s, again_truth = _truth(folder / "again")
    motion = Motion(*summary["map"]["motion"])
    poses = moved(motion, _columns(folder / "map/est.csv", "x_m", "y_m", "theta_rad"))
    observed = read_columns(folder / "explore/scene/observations.csv")
    wheels = odometry_path(np.column_stack([observed[f"odo_{name}"] for name in ("x_m", "y_m", "theta_rad")]))
    wheels = moved(best_motion(wheels[:, :2], truth[:, :2]), wheels)
    own = to_map(
        _columns(folder / "again/est_adaptive.csv", "x_m", "y_m", "theta_rad"), map_frame(load(folder / "map"))
    )
    errors = {"mapper": _off(poses, truth), "odometry": _off(wheels, truth)}
    return MapRun(folder, summary, scene, seconds, truth, poses, errors, again_s, _off(moved(motion, own), again_truth))


def moved(motion: Motion, poses: np.ndarray) -> np.ndarray:
    """Poses (n, 3) by a motion."""
    return np.column_stack([motion.points(poses[:, :2]), poses[:, 2] + motion.turn])


def _truth(folder: Path) -> tuple[np.ndarray, np.ndarray]:
    truth = read_columns(folder / "truth.csv")
    return (truth["tick"] + 1) * 500e-6, np.column_stack([truth[name] for name in ("x_m", "y_m", "theta_rad")])


def _columns(path: Path, *names: str) -> np.ndarray:
    columns = read_columns(path)
    return np.column_stack([columns[name] for name in names])


def _off(poses: np.ndarray, truth: np.ndarray) -> np.ndarray:
    return np.hypot(*(poses[:, :2] - truth[:, :2]).T)


def render(run: MapRun) -> str:
    """The page as text."""
    s, m, own = run.summary, run.summary["map"], run.summary["own"]
    origin = json.loads((run.folder / "origin.json").read_text())
    made = [("Command", f"`{origin['command']}`"), ("Seed", f"{s['seed']}")]
    made += [("Time", f"{s['simulated_s']:g} s simulated to map, {s['again_s']:g} s in the map")]
    made += [("Commit", f"{origin['commit']}, version {origin['version']}"), ("Machine", origin["machine"])]
    found = "never locked" if own["rows_to_lock"] is None else f"{0.1 * own['rows_to_lock']:.1f} s"
    shown = [
        (f"{1000 * m['error_median_m']:.0f} mm", "median position error while mapping", False),
        (f"{1000 * m['odometry_error_median_m']:.0f} mm", "odometry alone", False),
        (_share(m["tiles_right"]), "of the visited places have the right texture", False),
        (_share(m["free_right"]), "of the cells held free are", False),
        (found, "to find itself in its own map", own["rows_to_lock"] is None),
        (f"{1000 * own['error_median_m']:.0f} mm", "median error in its own map", False),
    ]
    lead = (
        f"{s['simulated_s']:g} s of exploration of an arena of which the robot knows nothing, mapped row by row by touch alone; then "
        f"{s['again_s']:g} s from another start, which is not known, in that map. Sensor, firmware, lanes, USB, ring, the base's "
        "driver, network, mapper and filter are the real parts or their bit-true models; arena, whiskers and base are simulated."
    )
    parts = [
        section("This run", pairs(made)),
        tiles(shown),
        _motion_card(run),
        section("How far off, while mapping", _error_figure(run, "mapper"), _pose_table(m)),
        section("The map", _map_table(m)),
        section("In its own map", _error_figure(run, "own map"), _own_table(s)),
        section("Throughput, loss", f'<div class="sheets">{loss_table(s | s["explore"])}</div>'),
        '<p class="lead">The map is a scene folder, <code>map</code>, beside this page, with an image for ROS map servers; '
        "every topic of the run is in <code>explore/robot.mcap</code>.</p>",
        page_script(),
    ]
    return document(f"CrunchBot: a map by touch, seed {s['seed']}", lead, parts)


def _share(share: float | None) -> str:
    return "none" if share is None else percent(share)


def _motion_card(run: MapRun) -> str:
    text = json.dumps(motion_data(run), separators=(",", ":"), allow_nan=False).replace("</", "<\\/")
    return f"""<section class="card" id="motion-card"><h2>The map as it grew</h2>
<div class="tools" id="motion-tools"><button id="motion-play" aria-pressed="false">Play</button>
<label>Speed <select id="motion-speed"><option value="1">1 ×</option><option value="4">4 ×</option>
<option value="16" selected>16 ×</option></select></label>
<input type="range" id="motion-time" min="0" step="1" aria-label="Time of the run"><output id="motion-clock"></output></div>
{LEGEND}<div id="motion-plans"></div>
<p>The map is brought onto the arena by the one rigid motion that fits the whole path best.</p>
<script type="application/json" id="motion-data">{text}</script></section>"""


def motion_data(run: MapRun) -> dict:
    """What the page's script is given; all in the arena's frame."""
    scene = {"arena": asdict(run.scene.arena), "robot": asdict(replace(run.scene.robot, sensors=())), "text": ""}
    poses = {"poses": _points(run.seconds, run.poses), "beliefs": []}
    maps = [frame | {"bounds": [0.0, 0.0, *run.scene.arena.size_m]} for frame in map_frames(run)]
    return {
        "scene": scene,
        "truth": _points(run.seconds, run.truth),
        "scales": [1.0],
        "filters": {
            "arena": {"title": "The arena, which the robot does not know", "note": "obstacles are grey"} | poses,
            "map": {"title": "The map"} | poses | {"maps": maps},
        },
    }


def _points(seconds: np.ndarray, poses: np.ndarray) -> list[list[float]]:
    return np.round(np.column_stack([seconds, poses]), 3).tolist()


def map_frames(run: MapRun) -> list[dict]:
    """Maps of the bag, FRAME_S apart and the last, in the arena's frame, each with the row that is the newest in it."""
    motion, frames, grid, due = Motion(*run.summary["map"]["motion"]), [], None, 0.0
    with McapFile(run.folder / "explore/robot.mcap") as file:
        for message in file.messages():
            kind = next(
                (kind for end, kind in TOPICS.items() if message.topic.endswith(end) and message.topic != end), None
            )
            if kind is None:
                continue
            given = decode(kind, bytes(message.data), message.topic)
            if kind is OccupancyGrid:
                grid = given
                continue
            last = {"row": int(given.observation_seq)} | brought(map_parts(given, grid and coarse(grid)), motion)
            if given.header.stamp.ns / 1e9 >= due:
                due = given.header.stamp.ns / 1e9 + FRAME_S
                frames.append(last)
    return [*frames, last] if frames and frames[-1]["row"] != last["row"] else frames


def coarse(grid: OccupancyGrid) -> OccupancyGrid:
    """The grid with cells twice as large, each as the one of four that is surest."""
    info, cells = grid.info, np.asarray(grid.data).reshape(grid.info.height, grid.info.width)
    rows, columns = (math.ceil(side / 2) for side in cells.shape)
    padded = np.full((2 * rows, 2 * columns), -1, np.int8)
    padded[: cells.shape[0], : cells.shape[1]] = cells
    four = padded.reshape(rows, 2, columns, 2).transpose(0, 2, 1, 3).reshape(rows, columns, 4)
    surest = np.where(four < 0, -1.0, np.abs(four - 50.0)).argmax(axis=2)
    kept = np.take_along_axis(four, surest[..., None], axis=2)[..., 0]
    return replace(
        grid, info=replace(info, resolution=2 * info.resolution, width=columns, height=rows), data=kept.ravel()
    )


def brought(parts: dict, motion: Motion) -> dict:
    """A map's parts by a motion."""

    def point(x: float, y: float) -> list[float]:
        return [round(float(v), 4) for v in motion.points(np.array([[x, y]]))[0]]

    faces = [[*point(f[0], f[1]), *point(f[2], f[3]), round(f[4] + motion.turn, 4), *f[5:]] for f in parts["faces"]]
    corners = [[*point(c[0], c[1]), c[2]] for c in parts["corners"]]
    lattice, grid = parts["lattice"], parts["grid"]
    if lattice:
        lattice = [*point(*lattice[:2]), round(lattice[2] + motion.turn, 4), lattice[3]]
    if grid:
        x, y = point(grid["x"], grid["y"])
        grid = grid | {"x": x, "y": y, "turn": round(grid["turn"] + motion.turn, 4)}
    return parts | {"faces": faces, "corners": corners, "lattice": lattice, "grid": grid}


def _error_figure(run: MapRun, which: str) -> str:
    curves = {which: run.again_error_m} if which == "own map" else run.error_m
    seconds = run.again_s if which == "own map" else run.seconds
    said = "; ".join(
        f"{STYLES[name][0]}: median {1000 * np.median(e):.0f} mm, at most {e.max():.2f} m" for name, e in curves.items()
    )

    def draw(_: MapRun, narrow: bool = False) -> Figure:
        drawn = figures.sized(2.8, 3.2, narrow)
        axes = drawn.subplots()
        for name, error in curves.items():
            title, style = STYLES[name]
            axes.plot(seconds, error, label=title, linewidth=1.4, **style)
        axes.set(xlabel="time (s)", ylabel="position error (m)", xlim=(0, seconds[-1]))
        axes.set_ylim(bottom=0)
        axes.grid(axis="y", color="#e4e4e4", linewidth=0.6)
        drawn.legend(loc="outside lower center", ncols=1 if narrow else 2)
        return drawn

    caption = {
        "mapper": "Poses of the time, from the rows until then; both paths are brought onto the true one by the rigid motion that fits best.",
        "own map": "Nothing is known of the start. The map is brought onto the arena by the motion of the first run's path.",
    }
    return figure(draw, run, f"Line chart of the position error over time. {said}.", caption[which])


def _pose_table(m: dict) -> str:
    rows = [
        (title, *(f"{m[f'{before}{key}']:.3f}" for key in ("error_median_m", "error_p90_m", "anchored_median_m")))
        for title, before in (("mapper", ""), ("odometry alone", "odometry_"))
    ]
    return table("Errors over all rows", ("poses", "median (m)", "90 % (m)", "median from the first pose (m)"), rows)


def _map_table(m: dict) -> str:
    rows = [
        ("faces", m["faces"]),
        ("length of faces within 15 mm and 1 degree of a true one", _share(m["faces_right"])),
        ("corners found, of those within reach of the path", _share(m["corners_found"])),
        ("corners that are none", _share(m["corners_false"])),
        ("tiles felt", m["tiles"]),
        ("visited places whose texture the map has for sure", _share(m["tiles_said"])),
        ("of these, right", _share(m["tiles_right"])),
        ("solid cells within 50 mm of something solid", _share(m["solid_right"])),
        ("free cells that are free", _share(m["free_right"])),
        ("rows of which the 90 % region holds the truth", _share(m["coverage_90"])),
    ]
    return table("After the rigid motion that fits the path best", ("quantity", "value"), rows)


def _own_table(s: dict) -> str:
    own = s["own"]
    locked = "never" if own["rows_to_lock"] is None else f"{0.1 * own['rows_to_lock']:.1f}"
    rows = [
        ("seconds until it has found itself for good", locked),
        ("median error from then on (m)", f"{own['error_median_m']:.3f}"),
        ("90 % of the errors from then on (m)", f"{own['error_p90_m']:.3f}"),
        ("tiles that the map knows", own["tiles_known"]),
    ]
    return table("The adaptive filter in the map of the first run", ("quantity", "value"), rows)
