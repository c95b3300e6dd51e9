"""The trial whether a base stops by itself, wheels up: one order to drive, then silence."""

import math
import time
from collections.abc import Callable

from ...base_table import BaseTable
from ...errors import UserError
from . import ALIVE_S, LOOK_S, REPEAT_S
from .motion import Said
from .signing import STOP_S
from .wire import Wire

TRIED_M_S, TRIED_SHARE = 0.1, 0.5  # of the order: at most, and of the greatest speed
TURNS_SHARE = 0.2  # of the order: the wheels turn; below it they stand
STANDS_S = 0.5  # they have stood for so long
COME_S, MOVE_S = 10.0, 2.0  # waited for the base, and for motion


class TrialError(UserError):
    """The trial has found no base that stops by itself; one line."""

    exit_code = 1


class Trial:
    """stop: whether somebody has lost patience. After `run`, however it ends, zero has been ordered for REPEAT_S."""

    def __init__(self, wire: Wire, base: BaseTable, stop: Callable[[], bool]):
        self._wire, self._stop = wire, stop
        self._order_m_s = min(TRIED_M_S, TRIED_SHARE * base.wheel_most_m_s)
        self._last: Said | None = None
        self._speed_m_s = 0.0

    def run(self) -> float:
        """Seconds from the order to standing wheels. TrialError: they do not stand by themselves, or nothing is there."""
        self._await(lambda: self._wire.look() and self._last, COME_S, "no odometry, or nobody takes orders")
        try:
            return self._order_once()
        finally:
            self._order_zero()

    def _order_once(self) -> float:
        self._await(lambda: self._speed_m_s < TURNS_SHARE * self._order_m_s, MOVE_S, "the wheels turn already")
        ordered_s = time.monotonic()
        self._wire.send(self._order_m_s, 0.0)
        self._await(self._turns, MOVE_S, "the wheels do not turn, or the odometry does not say so")
        turned_s = time.monotonic()

        def stands() -> bool:
            nonlocal turned_s
            turned_s = time.monotonic() if self._turns() else turned_s
            return time.monotonic() - turned_s >= STANDS_S

        self._await(stands, STOP_S, "THE WHEELS TURN ON: this base does not stop by itself; give it a time-out first")
        return max(turned_s - ordered_s, LOOK_S)

    def _turns(self) -> bool:
        return self._speed_m_s >= TURNS_SHARE * self._order_m_s

    def _await(self, found: Callable[[], object], most_s: float, failure: str) -> None:
        end_s = time.monotonic() + most_s
        while not found():
            if self._stop():
                raise TrialError("base: the trial was ended")
            if time.monotonic() >= end_s:
                raise TrialError(f"base: {failure}")
            time.sleep(LOOK_S)
            for said in self._wire.odometry():
                self._hear(said)

    def _hear(self, said: Said) -> None:
        """Its speed, by the pose; a base whose odometry has no pose would be seen as standing before it turned."""
        last, self._last = self._last, said
        if last and said.stamp_s > last.stamp_s:
            way_m = math.hypot(*(b - a for a, b in zip(last.pose[:2], said.pose[:2], strict=True)))
            self._speed_m_s = way_m / (said.stamp_s - last.stamp_s)

    def _order_zero(self) -> None:
        end_s = time.monotonic() + REPEAT_S
        while time.monotonic() < end_s:
            self._wire.send(0.0, 0.0)
            time.sleep(ALIVE_S)
