"""One object for a robot's rows, wherever they are: a scene folder, a bag, a robot that runs. `crunchbot.open` makes it.

run = crunchbot.open("examples/scene")      # or "robot.mcap", or "robot" while one runs
for row in run: ...                         # a Row: cells by column
run.localise("adaptive").poses              # (n, 3)
run.to_pandas()                             # a row of the robot in each line
run.show(), run.to_rerun("run.rrd")         # in a notebook, in the viewer of rerun: arena, truth, estimate
"""

import math
from collections.abc import Iterator, Sequence
from html import escape
from itertools import islice
from pathlib import Path

import numpy as np

from ..errors import UserError
from ..nav import localise
from ..nav.observations import Observations, joined, observations_path, observed, read_observations
from ..observation import ODOMETRY, TIME, TRUTH, Quantity, Row
from ..occupancy import from_map
from ..scene import Scene, load
from .bags.rows import is_bag, read_bag
from .network.link import NAVIGATOR_ENDPOINT, PILOT_ENDPOINT, Link
from .network.messages import NAME
from .network.rows import Follower

WIDE = 480  # pixels of a plan
STARTED_HERE = Path("robot-run/scene")  # where `whisker robot` puts the scene of a simulated robot
LOOK_S = 0.5  # between two looks whether rows have come


class OpenError(UserError):
    """What holds no rows; one line."""


def opened(
    source: str | Path, scene: str | Path | None = None, wait_s: float = 5.0, connect: Sequence[str] = ()
) -> "Rows | LiveRows":
    """Rows of a scene folder, a bag, or of a robot of this name. `scene`: folder with arena and robot, for a bag that lacks
    them and for a robot that runs: without it that of `whisker robot --simulated`, started from here. wait_s: for that robot's pilot; connect: its endpoints, tcp/HOST:PORT, if it is not on
    this machine. UserError says what is missing."""
    path = Path(source)
    if path.is_dir() and observations_path(path).exists():
        loaded = load(path)
        return Rows(loaded, read_observations(observations_path(path), loaded))
    if path.exists() and is_bag(path):
        return Rows(*read_bag(path, lambda line: None, None if scene is None else str(scene), None))
    if path.exists() or not NAME.fullmatch(str(source)):
        raise OpenError(f"{source}: no rows; give a scene folder, a robot's bag, or the name of a robot that runs")
    if scene is None and not STARTED_HERE.is_dir():
        raise OpenError(f"{source}: rows of a running robot need its scene; give scene=FOLDER")
    return LiveRows(str(source), load(scene or STARTED_HERE), wait_s, connect or (PILOT_ENDPOINT, NAVIGATOR_ENDPOINT))


class Rows:
    """Rows that have been: `scene`, and `observations` as columns. len() is their number."""

    def __init__(self, scene: Scene, observations: Observations):
        self.scene, self.observations = scene, observations

    def __len__(self) -> int:
        return len(self.observations)

    def __iter__(self) -> Iterator[Row]:
        columns = self.columns()
        times, motion = columns.pop(TIME), np.column_stack([columns.pop(name) for name in ODOMETRY])
        names = tuple(name for name in columns if name not in TRUTH)
        for n, t_s in enumerate(times):
            cells = [None if value == math.inf else value for value in (float(columns[name][n]) for name in names)]
            yield Row.made(0, float(t_s), motion[n], names, cells)

    def columns(self) -> dict[str, np.ndarray]:
        """Arrays (n,) by the names of observations.csv (docs/formats.md). Distances in mm: inf no contact, nan not read."""
        rows, layout = self.observations, self.scene.layout
        out = {TIME: rows.t_s, **dict(zip(ODOMETRY, rows.odometry.T, strict=True))}
        held = {Quantity.TEXTURE: rows.texture, Quantity.DISTANCE: 1000.0 * rows.radial_m, Quantity.READING: rows.own}
        held |= {Quantity.NORMAL: rows.normal, Quantity.POINT: rows.point}
        for quantity, values in held.items():
            if values is not None:
                flat = values.reshape(len(rows), -1).T if values.size else ()
                out |= dict(zip(layout.of(quantity), flat, strict=True))
        return out if rows.truth is None else out | dict(zip(TRUTH, rows.truth.T, strict=True))

    def localise(self, name: str = "", settings: dict[str, float] | None = None, seed: int = 0) -> localise.Run:
        """A filter over all rows, the default where none is named: poses (n, 3), confidence and cost of each row."""
        return localise.run(name or localise.default_filter(), self.scene, self.observations, settings, seed)

    def to_pandas(self):
        """A DataFrame of `columns`. Needs pandas."""
        from pandas import DataFrame

        return DataFrame(self.columns())

    def to_rerun(self, file: str | Path | None = None, name: str = "") -> None:
        """Rows, truth where it is known, and a filter's answers, for rerun: into a file.rrd, or a viewer that runs. Needs
        rerun-sdk."""
        from .rerun import RerunSink

        run, truth = self.localise(name), self.observations.truth
        with RerunSink(self.scene, file) as sink:
            for n, row in enumerate(self):
                sink.row(row)
                sink.pose(row.t_s, run.poses[n], run.name, float(run.table["confidence"][n]))
                if truth is not None and np.isfinite(truth[n]).all():
                    sink.pose(row.t_s, truth[n], "truth")

    def show(self, name: str = "") -> "Plan":
        """The arena with the true path, where it is known, and a filter's; a notebook draws it."""
        return Plan(self.scene, self.observations.truth, self.localise(name))


class LiveRows:
    """Rows of a robot that runs, as they come, from now on. Closed by `close`, or as a context manager."""

    def __init__(self, robot: str, scene: Scene, wait_s: float, connect: Sequence[str]):
        self.scene, self._robot = scene, robot
        self._link = Link("reader", robot, connect=connect)
        self._inbox, self._follower = self._link.subscribe("observation"), Follower()
        self._link.announce()
        if not self._link.wait_for(["pilot"], wait_s):
            self.close()
            raise OpenError(f"{robot}: no pilot answered within {wait_s:g} s; start 'whisker robot'")

    def __enter__(self) -> "LiveRows":
        return self

    def __exit__(self, *exception) -> None:
        self.close()

    def __iter__(self) -> Iterator[Row]:
        """Until the robot's stream ends; rows that were missed come without readings, so that no motion is lost. Motion inf:
        lifted, or not heard for 0.45 s, it may have been carried; a simulated base on a busy machine needs a lower --pace."""
        while True:
            received = self._inbox.take(timeout_s=LOOK_S)
            for step in self._follower.take(received):
                yield from step.lead()
                yield step.last()
            if any(one.over for one in received):
                return

    def take(self, count: int) -> Rows:
        """The next rows, so many or fewer when the robot ends. OpenError where none came."""
        rows = [observed(row, self.scene) for row in islice(self, count)]
        if not rows:
            raise OpenError(f"{self._robot}: ended before a row came; start 'whisker robot' again")
        return Rows(self.scene, joined(rows))

    def close(self) -> None:
        self._link.close()


class Plan:
    """What `Rows.show` draws, as SVG: solid what the filter says, dashed the truth."""

    def __init__(self, scene: Scene, truth: np.ndarray | None, run: localise.Run):
        self._scene, self._truth, self._run = scene, truth, run

    def _repr_html_(self) -> str:
        return f"<figure>{self.svg()}<figcaption>{escape('; '.join(self._caption()))}</figcaption></figure>"

    def svg(self) -> str:
        """The drawing; metres, y up."""
        wide, high = self._scene.arena.size_m
        boxes = "".join(
            f'<rect x="{x0:g}" y="{y0:g}" width="{x1 - x0:g}" height="{y1 - y0:g}" fill="#c9ced5" stroke="#303030"/>'
            for x0, y0, x1, y1 in self._scene.arena.obstacles
        )
        paths = self._path(self._run.poses, "#0b5394", "none")
        if self._truth is not None:
            paths += self._path(self._truth[np.isfinite(self._truth).all(axis=1)], "#c25700", "0.03")
        return (
            f'<svg viewBox="0 0 {wide:g} {high:g}" width="{WIDE}" stroke-width="{wide / WIDE:.4g}" role="img" '
            f'aria-label="{escape("; ".join(self._caption()))}"><g transform="matrix(1 0 0 -1 0 {high:g})">'
            f'<rect width="{wide:g}" height="{high:g}" fill="none" stroke="#303030"/>{boxes}{paths}</g></svg>'
        )

    def _path(self, poses: np.ndarray, colour: str, dashes: str) -> str:
        points = " ".join(f"{x:.3f},{y:.3f}" for x, y, _ in from_map(poses, self._scene.origin))
        return f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-dasharray="{dashes}"/>'

    def _caption(self) -> list[str]:
        return localise.spoken(self._run, self._truth)
