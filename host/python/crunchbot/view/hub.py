"""Holds the taps and the robot that pages look at, reads them 30 times a second, and says so to the pages' senders."""

import asyncio
import time

from ..errors import UserError
from ..fields import Fields
from ..robot.network import initial_pose
from ..scene import FARTHEST_M, Scene
from .recorder import Recorder
from .rings import find_rings
from .robot import RobotModel
from .robot_source import SPEED_LEAST, SPEED_MOST, NoRobot
from .tap import Tap

ROUND_S = 1 / 30
IDLE_S = 0.25  # between rounds while nobody looks: the counts go on, the ring holds seconds
SEARCH_S = 1.0  # between looks for rings
TAPS_MAX = 16
HOLD_S = 1.0  # between two words of a stop that lasts: a pilot that is started again must hear of it


class RequestError(ValueError):
    """What a page asked for cannot be had. Its text is one line: what, remedy."""


class Hub:
    """Rings named at the start are read for good; others while somebody looks at them."""

    def __init__(
        self,
        names: list[str],
        source: NoRobot | None = None,
        scene: Scene | None = None,
        ring_owner: int | None = None,
        may_set_pose: bool = False,
        recorder: Recorder | None = None,
    ):
        """`source`: where the robot's messages come from; `scene`: where it is and what it looks like, if known;
        `ring_owner`: the user whose rings are read, too; `may_set_pose`: pages may set where the robot is, and
        stop it; `recorder`: for pages that may record; None: none may.
        """
        self.names, self._ring_owner = names, ring_owner
        self.source = source or NoRobot()
        self.robot = RobotModel(scene, self.source.clock)
        self.may_set_pose = may_set_pose and bool(self.source.name) and not self.source.playback()
        self.recorder = recorder
        self.held, self._hold_due = False, float("inf")
        self.robot_watchers = 0
        self._taps = {name: Tap(name, owner=ring_owner) for name in names}
        self._watchers = dict.fromkeys(names, 0)
        self._found: dict[str, str] = {}
        self._searched = float("-inf")
        self._round = asyncio.Event()

    def rings(self) -> list[str]:
        """Rings that can be asked for: those named, then the others of this machine."""
        now = time.monotonic()
        if now - self._searched >= SEARCH_S:
            self._found, self._searched = find_rings(), now
        return self.names + [name for name in self._found if name not in self.names]

    def owners(self) -> dict[str, str]:
        """Whose each ring is that was found at the last look."""
        return self._found

    def watch(self, name: object) -> Tap:
        """The tap of a ring, for somebody who will `unwatch` it. RequestError: there is no such ring."""
        if not isinstance(name, str) or name not in self._taps and name not in self.rings():
            raise RequestError("ring: not one of this machine; take one that topic rings lists")
        if name not in self._taps:
            if len(self._taps) >= TAPS_MAX:
                raise RequestError(f"ring: {TAPS_MAX} are being looked at; close a page")
            self._taps[name], self._watchers[name] = Tap(name, owner=self._ring_owner), 0
            self._taps[name].poll()
        self._watchers[name] += 1
        return self._taps[name]

    def unwatch(self, tap: Tap) -> None:
        self._watchers[tap.name] -= 1
        if self._watchers[tap.name] == 0 and tap.name not in self.names:
            self._taps.pop(tap.name).close()
            del self._watchers[tap.name]

    def set_pose(self, request: dict) -> None:
        """Tell the robot's navigator the pose that a page asks for. RequestError: it is none, or it may not."""
        if not self.may_set_pose:
            raise RequestError("set_pose: not allowed here; start whisker-view with --robot and --allow-pose")
        try:
            pose = tuple(Fields(request).number(name, -FARTHEST_M, FARTHEST_M) for name in ("x", "y", "theta"))
            if self.robot.scene:
                initial_pose.prior_of(initial_pose.message_of(pose), self.robot.scene)
        except ValueError as error:
            raise RequestError(f"set_pose: {error}") from None
        self.source.set_pose(pose)

    def hold(self, request: dict) -> None:
        """Let the robot stand, or go on. RequestError: it may not."""
        if not self.may_set_pose:
            raise RequestError("hold: not allowed here; start whisker-view with --robot and --allow-pose")
        self.held = _is_on(request, "hold")
        self._tell_hold(time.monotonic())

    def _tell_hold(self, now: float) -> None:
        self.source.hold(self.held)
        self._hold_due = now + HOLD_S if self.held else float("inf")

    def record(self, request: dict) -> None:
        """Begin or end a recording: of the `ring` that is named, else of the robot. RequestError: it cannot be."""
        if self.recorder is None:
            raise RequestError("record: not allowed here; start whisker-view with --allow-pose, and without a bag")
        if not _is_on(request, "record"):
            return self.recorder.stop()
        ring = request.get("ring")
        if ring is not None and (not isinstance(ring, str) or ring not in self.rings()):
            raise RequestError("record: ring: not one of this machine; take one that topic rings lists")
        try:
            self.recorder.start(ring)
        except UserError as error:
            raise RequestError(f"record: {error}") from None

    def controls(self) -> dict:
        """What the header's buttons show."""
        recording = self.recorder.state() if self.recorder else None
        return {"recording": recording, "held": self.held, "said": self.recorder.said if self.recorder else ""}

    def play(self, request: dict) -> None:
        """Play the recording as a page asks for. RequestError: it asks for something else, or there is none."""
        playback = self.source.playback()
        if not playback:
            raise RequestError("play: no recording is played; start whisker-view with FILE.mcap")
        limits = {"speed": (SPEED_LEAST, SPEED_MOST), "at_s": (0.0, playback["length_s"])}
        asked = Fields(request)
        try:
            wanted = {name: asked.number(name, *bounds) for name, bounds in limits.items() if asked.has(name)}
            wanted |= {"playing": asked.flag("playing")} if asked.has("playing") else {}
        except ValueError as error:
            raise RequestError(f"play: {error}") from None
        self.source.play(**wanted)

    async def next_round(self) -> None:
        """Waits until the rings have been read once more."""
        await self._round.wait()

    async def run(self) -> None:
        """For ever."""
        while True:
            began = time.monotonic()
            for tap in self._taps.values():
                tap.poll()
            if self.source.jumped():
                self.robot.begin_anew()
            for topic, message in self.source.poll():
                self.robot.take(topic, message)
            if began >= self._hold_due:
                self._tell_hold(began)
            self._round.set()
            self._round = asyncio.Event()
            period = ROUND_S if self.robot_watchers or any(self._watchers.values()) else IDLE_S
            await asyncio.sleep(max(0.0, period - (time.monotonic() - began)))


def _is_on(request: dict, kind: str) -> bool:
    try:
        return Fields(request).flag("on")
    except ValueError as error:
        raise RequestError(f"{kind}: {error}") from None
