"""The navigator, the desktop's part: observations in, pose and belief out, at its own pace.

When it falls behind it weighs the newest rows that a tenth of a second is enough for, and takes the motion of all
before them (crunchbot.robot.network.rows.Follower); in lock-step it weighs every row. A navigator that begins in mid-run goes on
from what the one before it wrote down (crunchbot.robot.memory); without that it knows nothing of the start any more:
uniform prior. A pose that a user sets (crunchbot.robot.network.initial_pose) takes the place of all that was believed.
"""

import json
import math
import threading
import time
from contextlib import ExitStack
from dataclasses import dataclass, replace
from itertools import groupby
from pathlib import Path

import numpy as np

from ..nav.localise import Estimate
from ..nav.observations import observed
from ..observation import has_normals
from ..outputs import put
from ..scene import Prior, Scene
from .memory import Memory
from .network import belief, initial_pose
from .network.health import ENDED, RUNNING, Health
from .network.inbox import Received
from .network.initial_pose import InitialPoseError
from .network.link import Link
from .network.messages import Header, Localisation, PoseWithCovariance, PoseWithCovarianceStamped
from .network.ros import MAP_FRAME
from .network.row_checks import RowChecks
from .network.rows import Follower, Step
from .row_watch import RowWatch
from .track import Track

BELIEF_NS = 500_000_000  # 2 Hz of the bridge's clock
BELIEF_SHARE = 0.1  # of the navigator's time, at most, goes into publishing it
CATCH_UP_S = 0.1  # of the navigator's time for rows that came late together: no longer than until the next row
LOOK_S = 0.5  # between two words of health while nothing comes
SCENE_PRIOR, UNIFORM, CHECKPOINT, GIVEN = "scene", "uniform", "checkpoint", "given"
WAITING = "waiting for rows"
ROWS = "observation"  # topic


@dataclass
class Settings:
    """filters: the first one's pose is the robot's. out: folder of est_<filter>.csv; None: none is written.

    stay: go on after the end of a run, for the next. drill_step_s: every step takes at least so long, for drills.
    checkpoint: file of what is believed, for who is begun anew; None: none is kept. overwrite: files of `out` that are there.
    """

    filters: tuple[str, ...]
    out: Path | None = None
    stay: bool = False
    drill_step_s: float = 0.0
    checkpoint: Path | None = None
    overwrite: bool = False


class Navigator:
    """`run` until the end of the rows, or until stopped."""

    def __init__(self, link: Link, scene: Scene, settings: Settings):
        self._link, self._scene, self._settings = link, scene, settings
        self._inbox = link.subscribe(ROWS, initial_pose.TOPIC, judge=RowChecks(scene))
        self._reported: Prior | None = None
        self._reported_error = ""
        self._follower, self._watch = Follower(), RowWatch(scene.robot, scene)
        self._memory = Memory(settings.checkpoint, scene, settings.filters)
        self._beliefs_before: dict[str, np.ndarray] = {}
        self._tracks: list[Track] = []
        self._prior = ""
        self._poses, self._answers, self._beliefs = map(link.publish, ("pose", "localisation", "belief"))
        self._health = Health(link, self.counters)
        self._now_ns = self._belief_due_ns = 0
        self._weigh_s = self._step_s = self._belief_rest_s = 0.0

    def counters(self) -> dict[str, object]:
        """What has been counted so far; rows unless said otherwise."""
        follower, inbox = self._follower, self._inbox
        reported = {name: getattr(follower, name) for name in ("weighed", "skipped", "missed", "restarts")}
        reported |= {
            "first": follower.first_seq,
            "refused": inbox.refused,
            "overflown": inbox.overflown,
        }
        if self._tracks:
            reported |= {name: getattr(self._tracks[0].filter, name) for name in ("bad_cells", "bad_rows")}
        return reported | {"prior": self._prior, "step_us": round(self._step_s * 1e6)}

    def run(self, stop: threading.Event) -> dict[str, object]:
        """Returns the counters."""
        self._link.announce()
        reason = "stopped"
        with ExitStack() as stack:
            while not stop.is_set():
                received = self._inbox.take(LOOK_S)
                for topic, part in groupby(received, lambda one: one.topic):
                    (self._take_rows if topic == ROWS else self._take_poses)(list(part), stack)
                ends = [r.message.reason for r in received if r.over and r.topic == ROWS]
                if ends and not self._settings.stay:
                    reason = ends[0]
                    break
                self._health.report(self._now_ns, RUNNING if received else WAITING, self._last_error())
        for stream in (self._poses, self._answers, self._beliefs):
            stream.end(self._now_ns, reason)
        self._health.report(self._now_ns, ENDED, self._last_error())
        return self.counters()

    def _affordable(self) -> float:
        """Rows to be weighed of those that came together, by what the last one took; the newest while nothing is known."""
        if self._link.lock_step:
            return math.inf
        return max(1, CATCH_UP_S // self._weigh_s) if self._weigh_s else 1

    def _last_error(self) -> str:
        return self._inbox.last_error or self._reported_error or self._memory.note or self._watch.fault

    def _take_rows(self, received: list[Received], stack: ExitStack) -> None:
        if not self._tracks:
            self._recall(received)
        for step in self._follower.take(received, self._affordable()):
            self._take(step, stack)

    def _take_poses(self, received: list[Received], stack: ExitStack) -> None:
        """The newest given pose counts: at once, or when the first row comes."""
        for one in received:
            if not one.over:
                self._reported_error = ""
                try:
                    self._reported = initial_pose.prior_of(one.message, self._scene)
                except InitialPoseError as error:
                    self._reported_error = f"{initial_pose.TOPIC}: {error}"
        self._begin_from_reported()

    def _begin_from_reported(self) -> None:
        """All filters, or none where the first refuses it: they share the arena."""
        if not self._tracks or not self._reported:
            return
        prior, self._reported = self._reported, None
        try:
            for track in self._tracks:
                track.filter.set_prior(prior)
        except ValueError as error:
            self._reported_error = f"{initial_pose.TOPIC}: {error}"
        else:
            self._prior = GIVEN

    def _recall(self, received: list[Received]) -> None:
        """At the first row: goes on from where another navigator was, if it left a checkpoint."""
        first = next((r for r in received if not r.over), None)
        if first and (recalled := self._memory.recall(first)):
            place, self._beliefs_before = recalled
            self._follower.resume(place)

    def _take(self, step: Step, stack: ExitStack) -> None:
        began = time.monotonic()
        if not self._tracks:
            self._begin(stack, has_normals(step.row.names))
            self._begin_from_reported()
        for row in (*step.lead(), step.last()):
            self._watch.take(observed(row, self._scene))
        self._now_ns = step.row.header.stamp.ns
        header = Header.at(self._now_ns, MAP_FRAME)
        for track in self._tracks:
            self._answer(track, step, header, track.take(step))
        self._weigh_s = max(time.monotonic() - began, self._settings.drill_step_s)
        if self._belief_is_due():
            self._report_beliefs(header, step)
        self._step_s = time.monotonic() - began
        if self._step_s < self._settings.drill_step_s:
            time.sleep(self._settings.drill_step_s - self._step_s)

    def _belief_is_due(self) -> bool:
        """A belief is due at its own pace. In live runs rows go first: a belief that costs much to publish is published less often."""
        due = self._now_ns >= self._belief_due_ns or self._belief_due_ns > self._now_ns + BELIEF_NS
        return due and (self._link.lock_step or time.monotonic() >= self._belief_rest_s)

    def _report_beliefs(self, header: Header, step: Step) -> None:
        began, self._belief_due_ns = time.monotonic(), self._now_ns + BELIEF_NS
        few = {}
        for track in self._tracks:
            components = track.filter.components()
            few[track.name] = belief.condense(components)
            self._beliefs.send(belief.to_message(header, track.name, step.row.seq, len(components), few[track.name]))
        self._memory.keep(step, few)
        now = time.monotonic()
        self._belief_rest_s = now + (now - began) / BELIEF_SHARE

    def _begin(self, stack: ExitStack, normals: bool) -> None:
        """The prior is of the run's start: a process that joins later cannot use it."""
        before, out = self._beliefs_before, self._settings.out
        resumed = bool(before) or self._follower.first_seq > 0
        self._prior = CHECKPOINT if before else UNIFORM if resumed else SCENE_PRIOR
        scene = replace(self._scene, prior=Prior("uniform")) if resumed else self._scene
        self._tracks = [
            Track(name, scene, out, stack, resumed, before.get(name), normals, self._settings.overwrite)
            for name in self._settings.filters
        ]

    def _answer(self, track: Track, step: Step, header: Header, estimate: Estimate) -> None:
        pose = PoseWithCovariance.planar(estimate.pose, estimate.covariance)
        if track is self._tracks[0]:
            self._poses.send(PoseWithCovarianceStamped(header, pose))
            self._watch.answer(estimate.pose)
        follower, seq = self._follower, step.row.seq
        counts = (step.rows, follower.skipped, follower.missed, follower.first_seq)
        self._answers.send(Localisation(header, track.name, pose, estimate.confidence, seq, *counts, self._prior))


def write_report(path: Path, counters: dict[str, object]) -> None:
    """Counters as JSON."""
    put(path, json.dumps(counters, indent=1) + "\n")
