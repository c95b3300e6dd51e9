"""The mapper of a running robot, in the navigator's place: observations in, pose and map out; nothing is known of the arena.

The pose before the first row is the origin of the frame "map". Rows are written to a journal before they count, so that a
mapper that is begun anew holds the same map. It takes every row: a row costs it less than a millisecond.
"""

import math
import threading
import time
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ..nav.filters import COMPONENT
from ..nav.mapper import PATCH_M, Mapper, TouchMap
from ..nav.mapping import left_by, textures_in, write_map
from ..nav.observations import Observations, joined, observed
from ..observation import has_normals
from ..scene import Arena, Robot, Scene
from .journal import Journal
from .network import belief, messages
from .network.health import ENDED, RUNNING, Health
from .network.inbox import Received
from .network.link import Link
from .network.messages import Header, Localisation, Observation, PoseWithCovariance, PoseWithCovarianceStamped
from .network.ros import MAP_FRAME, MapMetaData, OccupancyGrid, Pose
from .network.row_checks import RowChecks
from .network.rows import Follower, Step
from .row_watch import RowWatch

NAME = "mapper"  # of the process, and of the filter in its answers
MAP_NS, BELIEF_NS = 1_000_000_000, 500_000_000  # of the bridge's clock, between two maps and two beliefs
MAP_SHARE = 0.1  # of the mapper's time, at most, goes into publishing maps
LOOK_S = 0.5
WAITING = "waiting for rows"
ORIGIN, JOURNAL = "origin", "checkpoint"  # what it began from
ROWS = "observation"


@dataclass(frozen=True)
class Settings:
    """out: folder of the map, written at the end of a run; None: none is. stay: go on after it, for the next. journal: file of
    the rows taken; None: none is kept."""

    out: Path | None = None
    stay: bool = False
    journal: Path | None = None


class MapperProcess:
    """`run` until the end of the rows, or until stopped."""

    def __init__(self, link: Link, robot: Robot, settings: Settings):
        self._link, self._robot, self._settings = link, replace(robot, sensors=()), settings
        self._checks: RowChecks | None = None
        self._inbox = link.subscribe(ROWS, judge=self._fault)
        self._journal = Journal(settings.journal, self._robot)
        self._poses, self._answers, self._beliefs, self._grids, self._maps = map(
            link.publish, ("pose", "localisation", "belief", "map", "touch_map")
        )
        self._health = Health(link, self.counters)
        self._map_s = 0.0  # wall time before which no map is published again
        self._begin()

    def _begin(self) -> None:
        """Nothing is known."""
        self._follower, self._scene, self._mapper = Follower(), None, None
        self._rows: list[Observations] = []
        self._watch = RowWatch(self._robot)
        self._tables: list[np.ndarray] = []
        self._steps_us: list[np.ndarray] = []
        self._now_ns = self._map_due_ns = self._belief_due_ns = 0
        self._seq, self._touched, self._prior, self._lost_at = 0, None, ORIGIN, ""

    def counters(self) -> dict[str, object]:
        """What has been counted so far; rows unless said otherwise."""
        follower = self._follower
        reported = {name: getattr(follower, name) for name in ("weighed", "missed", "restarts")}
        reported |= {"first": follower.first_seq, "refused": self._inbox.refused, "overflown": self._inbox.overflown}
        if self._mapper:
            reported |= {"bad_cells": self._mapper.bad_cells, "bad_rows": self._mapper.bad_rows}
            reported |= {"lost": self._mapper.frame}
        if self._touched:
            faces = len({int(n) for n in self._touched.faces["face"]})
            reported |= {"faces": faces, "tiles": len(self._touched.tiles)}
        return reported | {"step_us": round(float(self._steps_us[-1].sum())) if self._steps_us else 0}

    def run(self, stop: threading.Event) -> dict[str, object]:
        """Returns the counters. OutputError when the map cannot be written."""
        self._recall()
        self._link.announce()
        reason = "stopped"
        while not stop.is_set():
            received = self._inbox.take(LOOK_S)
            for one in received:
                if not one.over:
                    self._journal.keep(one)
            self._take(received)
            ends = [r.message.reason for r in received if r.over]
            if ends:
                self._write()
                reason = ends[0]
                if not self._settings.stay:
                    break
            self._health.report(self._now_ns, RUNNING if received else WAITING, self._last_error())
        if stop.is_set():
            self._write()
        self._journal.close()
        for stream in (self._poses, self._answers, self._beliefs, self._grids, self._maps):
            stream.end(self._now_ns, reason)
        self._health.report(self._now_ns, ENDED, self._last_error())
        return self.counters()

    def _last_error(self) -> str:
        return self._inbox.last_error or self._journal.note or self._lost_at or self._watch.fault

    def _recall(self) -> None:
        """Takes the rows of the journal again, without a word about each."""
        taken, self._journal.taken = self._journal.taken, []
        for one in taken:
            if not self._fault(one):
                for step in self._follower.take([one]):
                    self._step(step)
        self._prior = JOURNAL if taken else ORIGIN

    def _fault(self, one: Received) -> str:
        """As RowChecks: of the first row the textures are taken, all others must have the same."""
        if not isinstance(one.message, Observation):
            return ""
        if self._checks is None:
            self._learn(one.message.names)
            if fault := self._checks(one):
                self._checks = self._scene = None
            return fault
        return self._checks(one)

    def _learn(self, names: Iterable[str]) -> None:
        textures = textures_in(names, self._robot) or ("NONE",)
        self._scene = Scene(Arena((PATCH_M, PATCH_M), PATCH_M, textures, ("?",), ()), self._robot)
        self._checks = RowChecks(self._scene)

    def _take(self, received: list[Received]) -> None:
        for step in self._follower.take([one for one in received if not one.over]):
            self._answer(step, self._step(step))

    def _step(self, step: Step) -> np.ndarray:
        """The estimate after a step's rows, an element of ESTIMATE."""
        rows = [*step.lead(), step.last()]
        if self._mapper is None:
            normals = has_normals(step.row.names)
            self._mapper = Mapper(self._robot, self._scene.arena.textures, normals=normals)
        taken = joined([observed(row, self._scene) for row in rows])
        part, t_s = self._mapper.frame, float(taken.t_s[-1])
        table, step_us = self._mapper.replay(taken, 0, len(taken))
        if self._mapper.frame != part:
            self._lost_at = f"lost at {t_s:.1f} s: the robot was carried off; a new map began"
        self._rows.append(taken)
        self._watch.take(taken)
        self._tables.append(table)
        self._steps_us.append(step_us)
        self._now_ns, self._seq = step.row.header.stamp.ns, step.row.seq
        return table[-1]

    def _answer(self, step: Step, estimate: np.ndarray) -> None:
        header = Header.at(self._now_ns, MAP_FRAME)
        covariance = estimate["covariance"].reshape(3, 3)
        pose = PoseWithCovariance.planar(estimate["pose"], covariance)
        self._poses.send(PoseWithCovarianceStamped(header, pose))
        follower, sure = self._follower, float(estimate["confidence"])
        counts = (step.rows, follower.skipped, follower.missed, follower.first_seq)
        self._answers.send(Localisation(header, NAME, pose, sure, self._seq, *counts, self._prior))
        if self._is_due(self._belief_due_ns, BELIEF_NS):
            self._belief_due_ns = self._now_ns + BELIEF_NS
            self._beliefs.send(belief.to_message(header, NAME, self._seq, 1, _component(estimate)))
        if self._is_due(self._map_due_ns, MAP_NS) and (self._link.lock_step or time.monotonic() >= self._map_s):
            self._publish(header)

    def _is_due(self, due_ns: int, every_ns: int) -> bool:
        return not due_ns - every_ns <= self._now_ns < due_ns

    def _publish(self, header: Header) -> None:
        began, self._map_due_ns = time.monotonic(), self._now_ns + MAP_NS
        self._touched = self._mapper.map()
        if self._touched.grid is not None and self._touched.grid.occupied.size:
            self._grids.send(to_grid(header, self._touched))
        self._maps.send(to_message(header, self._seq, self._scene.arena.textures, self._touched))
        now = time.monotonic()
        self._map_s = now + (now - began) / MAP_SHARE

    def _write(self) -> None:
        """The map folder of all rows so far."""
        if self._mapper is None:
            return
        self._touched = self._mapper.map()
        if self._settings.out is None:
            return
        table, step_us, textures = (
            np.concatenate(self._tables),
            np.concatenate(self._steps_us),
            self._scene.arena.textures,
        )
        rows = joined(self._rows)
        write_map(
            self._settings.out, left_by(self._mapper, self._robot, textures, rows, table, step_us), overwrite=True
        )


def _component(estimate: np.ndarray) -> np.ndarray:
    """The estimate as the one component of a belief."""
    out, covariance = np.zeros(1, COMPONENT), estimate["covariance"].reshape(3, 3)
    out["pose"], out["mass"] = estimate["pose"], 1.0
    out["sigma_m"] = math.sqrt(max((covariance[0, 0] + covariance[1, 1]) / 2, 0.0))
    out["sigma_rad"] = math.sqrt(max(covariance[2, 2], 0.0))
    return out


def to_grid(header: Header, touched: TouchMap) -> OccupancyGrid:
    """The occupancy as ROS has it: per cent; a cell of which nothing is known is -1."""
    grid = touched.grid
    per_cent = np.where(grid.occupied == 0.5, -1, np.rint(100.0 * grid.occupied)).astype(np.int8)
    rows, columns = grid.occupied.shape
    info = MapMetaData(header.stamp, grid.cell, columns, rows, Pose.planar(grid.x, grid.y, 0.0))
    return OccupancyGrid(header, info, per_cent.ravel())


def to_message(header: Header, seq: int, textures: tuple[str, ...], touched: TouchMap) -> messages.TouchMap:
    """The map after row `seq`, without the occupancy."""
    found, faces, corners = touched.lattice, touched.faces, touched.corners
    tiles = np.array([(*tile, *said) for tile, said in sorted(touched.tiles.items())]).reshape(-1, 4)
    stretches = (faces[name] for name in ("x0", "y0", "x1", "y1", "normal", "normal_sigma", "offset_sigma"))
    corner_sd = np.sqrt(np.maximum((corners["xx"] + corners["yy"]) / 2, 0.0))
    return messages.TouchMap(
        header,
        seq,
        touched.frame,
        list(textures),
        np.array([found.x, found.y, found.turn, found.pitch] if found else [0.0] * 4),
        *tiles.T,
        *stretches,
        corners["x"],
        corners["y"],
        corner_sd,
    )
