"""What the pilot needs of the base, behind one interface with two clocks: in step with a simulation, and live.

    report = wheels.odometry(tick)   # every 0.1 s: motion since the last report; None: there is none
    wheels.drive(tick, v, omega)     # every block

In step: simulated time waits for every answer, and the base's serial stream is taken in up to the byte that had been
sent when the block ended: the same run gives the same bytes. Live: as soon as it can be had.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from ..base_table import BaseTable
from ..pilot.base import Base, BaseError, Motion
from ..pilot.wheels import NO_BUMPS, Bumps, Wheels
from .simulation_link import SimLink

MODE = "safe"  # the base then stops by itself at cliffs and wheel drops
RETRY_S = 0.2  # between looks for a base that is not there
ANSWER_S = 0.5  # a base that does not answer for so long is taken for lost


@dataclass(frozen=True)
class Report:
    """Motion in the robot frame at its start (m, m, rad), covariance (3, 3), and what the base feels."""

    motion: tuple[float, float, float]
    covariance: np.ndarray = field(default_factory=lambda: np.zeros((3, 3)))
    bumps: Bumps = NO_BUMPS


class IdealWheels:
    """No base at all: the simulated wheels obey at once, and their odometry comes as numbers."""

    def __init__(self, sim: SimLink):
        self._sim = sim

    def odometry(self, tick: int) -> Report | None:
        motion = self._sim.odometry(tick)
        return None if motion is None else Report(motion)

    def drive(self, tick: int, v_m_s: float, omega_rad_s: float) -> None:
        self._sim.drive(tick, v_m_s, omega_rad_s)

    def recover(self) -> None:
        """These wheels are never lost."""

    def health(self) -> dict[str, str]:
        return {}


class SteppedBase:
    """The driver of the base on the simulation's serial line, in step with it."""

    def __init__(self, sim: SimLink, base: Base):
        self._sim, self._base = sim, base

    def odometry(self, tick: int) -> Report | None:
        after = self._sim.bytes_sent(tick)
        return None if after is None else _report(self._base.odometry(after))

    def drive(self, tick: int, v_m_s: float, omega_rad_s: float) -> None:
        after = self._sim.bytes_sent(tick)
        if after is not None:
            self._sim.base(tick, self._base.drive(v_m_s, omega_rad_s, after).byte_count)

    def recover(self) -> None:
        """Take the base over again."""
        self._base.mode(MODE)

    def health(self) -> dict[str, str]:
        return self._base.health()


class LiveBase:
    """The driver as it comes and goes: what cannot be asked is None, `trouble` says why, and it is tried again."""

    def __init__(self, path: str, clock: Callable[[], float] = time.monotonic):
        self.trouble = f"{path}: not yet asked"
        self.lost = 0  # times the driver was gone
        self._path, self._clock, self._next_try = path, clock, float("-inf")
        self._base: Base | None = None

    def odometry(self, tick: int) -> Report | None:
        reported = self._try(lambda base: base.odometry())
        return None if reported is None else _report(reported)

    def drive(self, tick: int, v_m_s: float, omega_rad_s: float) -> None:
        self._try(lambda base: base.drive(v_m_s, omega_rad_s))

    def recover(self) -> None:
        """Take the base over again after it has left its mode, as at a cliff."""
        self._try(lambda base: base.mode(MODE))

    def stop(self) -> None:
        """Stop the wheels now."""
        self._try(lambda base: base.stop())

    def health(self) -> dict[str, str]:
        return self._try(lambda base: base.health()) or {}

    def close(self) -> None:
        if self._base:
            self._base.close()

    def _try(self, ask):
        if self._base is None and not self._reconnect():
            return None
        try:
            return ask(self._base)
        except BaseError as error:
            self._base.close()
            self._base, self.trouble = None, str(error)
            self.lost += 1
            return None

    def _reconnect(self) -> bool:
        if self._clock() < self._next_try:
            return False
        self._next_try = self._clock() + RETRY_S
        try:
            self._base, self.trouble = Base(self._path, ANSWER_S), ""
        except BaseError as error:
            self.trouble = str(error)
        return self._base is not None


def _report(reported: Motion) -> Report:
    return Report(
        (reported.x_m, reported.y_m, reported.theta_rad), np.array(reported.covariance), Bumps.of_bits(reported.bits)
    )


def wheels_of(health: dict[str, str], base: BaseTable) -> Wheels:
    """What the base of this health can do; `base`: as robot.toml has it."""
    own = {"wheel_step_m_s": float(health["speed_step_m_s"]), "wheel_base_m": float(health["wheel_base_m"])}
    return Wheels.of(replace(base, **own))
