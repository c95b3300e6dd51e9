"""The faults: how each begins and ends, whether it takes the wheels their commander, and which gap it makes."""

import os
import signal
import threading
from collections.abc import Callable
from dataclasses import dataclass

from .machine import Machine

SLOWED = 10  # times slower
SLICE_S = 0.02
LOST_SHARE = 0.02  # of the bytes of a bad line
WHISKER = 3  # lane of the object whisker that dies: one of the two in front


@dataclass(frozen=True)
class Fault:
    """`begin` and `end` do it; `lasts`: least and most seconds between.

    commander: the wheels lose who commands them, and have to stop. gap: what is lost, a name of gaps.GAPS.
    """

    name: str
    begin: Callable[[Machine], None]
    end: Callable[[Machine], None]
    lasts: tuple[float, float] = (0.0, 0.0)
    commander: bool = False
    gap: str = ""


def nothing(machine: Machine) -> None:
    """The end of what the supervisor mends."""


def killed(name: str, what: str, **options) -> Fault:
    return Fault(what, lambda machine: machine.kill(name), nothing, **options)


class Slowed(threading.Thread):
    """Lets a process run a tenth of the time."""

    def __init__(self, pid: int):
        super().__init__(daemon=True)
        self._pid, self._stop_event = pid, threading.Event()

    def run(self) -> None:
        try:
            while not self._stop_event.is_set():
                os.kill(self._pid, signal.SIGSTOP)
                self._stop_event.wait(SLICE_S * (SLOWED - 1))
                os.kill(self._pid, signal.SIGCONT)
                self._stop_event.wait(SLICE_S)
        finally:
            os.kill(self._pid, signal.SIGCONT)

    def end(self) -> None:
        self._stop_event.set()
        self.join()


class Desktop:
    """The processes of the desktop, slowed."""

    def __init__(self):
        self._slowed: list[Slowed] = []

    def slow(self, machine: Machine) -> None:
        self._slowed = [Slowed(pid) for name in ("navigator", "bag", "view") if (pid := machine.pid(name))]
        for thread in self._slowed:
            thread.start()

    def free(self, machine: Machine) -> None:
        for thread in self._slowed:
            thread.end()


def _network(way: str) -> Callable[[Machine], None]:
    return lambda machine: machine.hands.do(getattr(machine.hands.network, way))


def _line(share: float) -> Callable[[Machine], None]:
    return lambda machine: machine.hands.do(machine.hands.line.lose, share)


def _simulation(text: str) -> Callable[[Machine], None]:
    return lambda machine: machine.report_simulation(text)


DESKTOP = Desktop()
FAULTS = (
    killed("whiskerd", "whiskerd killed", commander=True, gap="frames"),
    killed("driver", "driver of the base killed", commander=True, gap="base"),
    killed("base", "guard of the base killed", commander=True, gap="base"),
    killed("pilot", "pilot killed", commander=True, gap="pilot"),
    killed("navigator", "navigator killed", gap="rows"),
    killed("bag", "recorder killed", gap="bag"),
    killed("view", "view killed"),
    Fault("desktop ten times slower, 10 s", DESKTOP.slow, DESKTOP.free, (10.0, 10.0), gap="rows"),
    Fault("network held, 5 s", _network("hold"), _network("mend"), (5.0, 5.0), gap="rows"),
    Fault("network broken, 5 s", _network("reset"), _network("mend"), (5.0, 5.0), gap="rows"),
    Fault("USB cable pulled", _simulation("unplug"), _simulation("plug"), (2.0, 6.0), commander=True, gap="frames"),
    Fault("whisker dead", _simulation(f"dead {WHISKER}"), _simulation(f"well {WHISKER}"), (5.0, 10.0), gap="whisker"),
    Fault("base loses 2 % of its bytes", _line(LOST_SHARE), _line(0.0), (4.0, 8.0), gap="line"),
    Fault("base silent", _line(1.0), _line(0.0), (1.0, 4.0), gap="line"),
)
