"""Plays a robot's bag in the page: what was said comes again, at any speed and from any moment."""

import time
from bisect import bisect_right
from collections.abc import Callable, Iterator

from ..robot.bags.played import Played, Said
from ..robot.network.messages import HEALTH
from .robot import PATH_MOST
from .robot_source import NoRobot

PATH_S = PATH_MOST / 10  # what a page keeps of a path
NEWEST = ("belief", HEALTH)  # topics of which the newest says all


class Playback(NoRobot):
    """Stands at the beginning until somebody looks. `monotonic` is replaced by tests."""

    def __init__(self, played: Played, monotonic: Callable[[], float] = time.monotonic):
        self.name, self._said, self._monotonic = played.robot, played.said, monotonic
        self._times = [said.at_s for said in played.said]
        self._damage = played.damage
        self.length_s = self._times[-1]
        self._at_s = self._shown_s = 0.0
        self._went_s = monotonic()
        self._is_looked_at = self._is_playing = self._is_new = False
        self._speed = 1.0
        self._next = 0

    def link(self) -> dict:
        return {"state": "open", "text": "A recording is played"}

    def refused(self) -> dict:
        return {"count": len(self._damage), "last": self._damage[-1] if self._damage else "", "missed": 0}

    def clock(self) -> float:
        return self._shown_s

    def look(self) -> None:
        if not self._is_looked_at:
            self._is_looked_at = True
            self.play(playing=True)

    def playback(self) -> dict:
        at = {"at_s": round(self._at_s, 1), "length_s": round(self.length_s, 1)}
        return at | {"playing": self._is_playing, "speed": self._speed}

    def play(self, playing: bool | None = None, speed: float | None = None, at_s: float | None = None) -> None:
        self._go_on()
        self._speed = self._speed if speed is None else speed
        if playing and at_s is None and self._at_s >= self.length_s:
            at_s = 0.0
        if at_s is not None:
            self._at_s, self._is_new = min(at_s, self.length_s), True
        self._is_playing = self._is_playing if playing is None else playing

    def jumped(self) -> bool:
        return self._is_new

    def poll(self) -> Iterator[tuple]:
        self._go_on()
        if self._is_new:
            self._is_new, self._next = False, bisect_right(self._times, self._at_s)
            yield from map(self._show, self._before())
        while self._next < len(self._said) and self._times[self._next] <= self._at_s:
            self._next += 1
            yield self._show(self._said[self._next - 1])
        self._shown_s = self._at_s

    def _show(self, said: Said) -> tuple:
        self._shown_s = said.at_s
        return said.topic, said.message

    def _before(self) -> list[Said]:
        """What a page shows at this moment: the path's time, and the newest of what only the newest matters of."""
        newest, kept = {}, []
        for said in self._said[: self._next]:
            if said.topic.partition("/")[0] in NEWEST:
                newest[said.topic, getattr(said.message, "filter", "")] = said
            elif said.at_s >= self._at_s - PATH_S:
                kept.append(said)
        return sorted([*kept, *newest.values()], key=lambda said: said.at_s)

    def _go_on(self) -> None:
        now = self._monotonic()
        if self._is_playing:
            self._at_s = min(self.length_s, self._at_s + self._speed * (now - self._went_s))
            self._is_playing = self._at_s < self.length_s
        self._went_s = now
