"""The navigator, the desktop's part: observations in, pose and belief out, at its own pace.

When it falls behind it weighs the newest row and takes the motion of all before it (whisker.robot.rows.Follower); in
lock-step it weighs every row. A navigator that begins in mid-run knows nothing of the start any more: uniform prior.
"""

import json
import threading
import time
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path

from ..errors import UserError
from ..localise import Estimate
from ..scene import Prior, Scene
from . import belief
from .health import ENDED, RUNNING, Health
from .link import Link
from .messages import ARENA_FRAME, Header, Localisation, PoseWithCovariance, PoseWithCovarianceStamped
from .rows import Follower, Step, time_text
from .track import Track

BELIEF_NS = 500_000_000  # 2 Hz of the bridge's clock
BELIEF_SHARE = 0.1  # of the navigator's time, at most, goes into telling it
LOOK_S = 0.5  # between two words of health while nothing comes
SCENE_PRIOR, UNIFORM = "scene", "uniform"
WAITING = "waiting for rows"


class NavigatorError(UserError):
    """Rows that this scene does not fit; one line."""

    exit_code = 1


@dataclass
class Settings:
    """filters: the first one's pose is the robot's. out: folder of est_<filter>.csv; None: none is written.

    stay: go on after the end of a run, for the next. drill_step_s: every step takes at least so long, for drills.
    """

    filters: tuple[str, ...]
    out: Path | None = None
    stay: bool = False
    drill_step_s: float = 0.0


class Navigator:
    """`run` until the end of the rows, or until stopped."""

    def __init__(self, link: Link, scene: Scene, settings: Settings):
        self._link, self._scene, self._settings = link, scene, settings
        self._wanted = _columns(scene)
        self._inbox = link.subscribe("observation")
        self._follower = Follower(link.lock_step)
        self._tracks: list[Track] = []
        self._prior = ""
        self._poses, self._answers, self._beliefs = map(link.publish, ("pose", "localisation", "belief"))
        self._health = Health(link, self.counters)
        self._now_ns = self._belief_due_ns = 0
        self._step_s = self._belief_rest_s = 0.0

    def counters(self) -> dict[str, object]:
        """What has been counted so far; rows unless said otherwise."""
        follower, inbox = self._follower, self._inbox
        told = {name: getattr(follower, name) for name in ("weighed", "skipped", "missed", "restarts")}
        told |= {"first": follower.first_seq, "refused": inbox.refused, "overflown": inbox.overflown}
        if self._tracks:
            told |= {name: getattr(self._tracks[0].filter, name) for name in ("bad_cells", "bad_rows")}
        return told | {"prior": self._prior, "step_us": round(self._step_s * 1e6)}

    def run(self, stop: threading.Event) -> dict[str, object]:
        """Returns the counters. NavigatorError when a row lacks what the scene's whiskers tell."""
        self._link.announce()
        reason = "stopped"
        with ExitStack() as stack:
            while not stop.is_set():
                received = self._inbox.take(LOOK_S)
                for step in self._follower.take(received):
                    self._take(step, stack)
                if not self._settings.stay and any(r.over for r in received):
                    reason = next(r.message.reason for r in received if r.over)
                    break
                self._health.tell(self._now_ns, RUNNING if received else WAITING, self._inbox.last_error)
        for stream in (self._poses, self._answers, self._beliefs):
            stream.end(self._now_ns, reason)
        self._health.tell(self._now_ns, ENDED, self._inbox.last_error)
        return self.counters()

    def _take(self, step: Step, stack: ExitStack) -> None:
        began = time.monotonic()
        if missing := self._wanted - set(step.row.names):
            text = f"observation: cell {min(missing)} is missing; give the navigator the scene of this robot"
            raise NavigatorError(text)
        if not self._tracks:
            self._begin(stack)
        cells, self._now_ns = step.cells(), step.row.header.stamp.ns
        header = Header.at(self._now_ns, ARENA_FRAME)
        for track in self._tracks:
            self._answer(track, step, header, track.take(time_text(cells), cells))
        if self._belief_is_due():
            self._tell_beliefs(header, step.row.seq)
        self._step_s = time.monotonic() - began
        time.sleep(max(0.0, self._settings.drill_step_s - self._step_s))

    def _belief_is_due(self) -> bool:
        """At the belief's pace; live, rows go first: when telling it is much work it is told less often."""
        due = self._now_ns >= self._belief_due_ns or self._belief_due_ns > self._now_ns + BELIEF_NS
        return due and (self._link.lock_step or time.monotonic() >= self._belief_rest_s)

    def _tell_beliefs(self, header: Header, seq: int) -> None:
        began, self._belief_due_ns = time.monotonic(), self._now_ns + BELIEF_NS
        for track in self._tracks:
            self._beliefs.send(belief.to_message(header, track.name, seq, track.filter.components()))
        now = time.monotonic()
        self._belief_rest_s = now + (now - began) / BELIEF_SHARE

    def _begin(self, stack: ExitStack) -> None:
        """The prior is of the run's start: whoever joins later cannot use it."""
        resumed = self._follower.first_seq > 0
        self._prior = UNIFORM if resumed else SCENE_PRIOR
        scene = replace(self._scene, prior=Prior("uniform")) if resumed else self._scene
        out = self._settings.out
        self._tracks = [Track(name, scene, out, stack, resumed) for name in self._settings.filters]

    def _answer(self, track: Track, step: Step, header: Header, estimate: Estimate) -> None:
        pose = PoseWithCovariance.planar(estimate.pose, estimate.covariance)
        if track is self._tracks[0]:
            self._poses.send(PoseWithCovarianceStamped(header, pose))
        follower, seq = self._follower, step.row.seq
        counts = (step.rows, follower.skipped, follower.missed, follower.first_seq)
        self._answers.send(Localisation(header, track.name, pose, estimate.confidence, seq, *counts, self._prior))


def _columns(scene: Scene) -> set[str]:
    """Cells that a row of this scene must have."""
    textures = {f"{w.name}_{t}" for w in scene.robot.of_role("texture") for t in scene.arena.textures}
    return textures | {f"{w.name}_mm" for w in scene.robot.of_role("object")}


def write_report(path: Path, counters: dict[str, object]) -> None:
    """Counters as JSON."""
    path.write_text(json.dumps(counters, indent=1) + "\n")
