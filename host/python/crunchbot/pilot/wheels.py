"""What a base can do and what it reports beside odometry, whatever its make."""

import math
from dataclasses import dataclass

from ..base_table import CREATE, BaseTable
from . import base
from .states import (
    BACK_OFF_LIMIT_M,
    BACK_OFF_M_S,
    EFFECT_TICKS,
    EXPLORE_M_S,
    PUSH_TICKS,
    TICK_S,
    TURN_RAD_S,
    WHISK_RAD_S,
)

BRAKE_MOST_M = BACK_OFF_LIMIT_M / 2.0  # after a touch: the other half of the way back is for the whisker to come free


@dataclass(frozen=True)
class Wheels:
    """Speeds, m/s and rad/s, of exploring and turning, of the body whisk and of slow backing off; ticks from a block's end to
    its answer's effect; what the wheels' changes of speed take is in `base`."""

    explore_m_s: float = EXPLORE_M_S
    turn_rad_s: float = TURN_RAD_S
    whisk_rad_s: float = WHISK_RAD_S
    back_off_m_s: float = BACK_OFF_M_S
    effect_ticks: int = EFFECT_TICKS
    base: BaseTable = CREATE

    @classmethod
    def of(cls, base: BaseTable, effect_ticks: int = EFFECT_TICKS) -> "Wheels":
        """Those of a base whose speeds are multiples of its step: body whisk and backing off at the nearest to the paper's
        that move at all. A base that cannot drive, turn or brake as a pilot wants to is slower in both, so that the tips
        sweep the floor at one speed."""
        step, most, half_m = base.wheel_step_m_s, base.wheel_most_m_s, base.wheel_base_m / 2.0

        def nearest(wheel_m_s: float) -> float:
            return step * max(1, round(min(wheel_m_s, most) / step))

        braking = math.sqrt(2.0 * base.acceleration_m_s2 * BRAKE_MOST_M) if base.acceleration_m_s2 else math.inf
        share = min(1.0, min(most, braking) / EXPLORE_M_S, most / (TURN_RAD_S * half_m))
        explore, turn = max(step, share * EXPLORE_M_S), max(step / half_m, share * TURN_RAD_S)
        whisk = nearest(WHISK_RAD_S * half_m) / half_m
        return cls(explore, turn, whisk, nearest(BACK_OFF_M_S), effect_ticks, base)

    @classmethod
    def without_driver(cls, base: BaseTable) -> "Wheels":
        """Simulated ones, which obey at once: any speed, but for what robot.toml says of the base."""
        return cls() if base == CREATE else cls.of(base)

    def steady_ticks(self, before: tuple[float, float], after: tuple[float, float]) -> int:
        """Ticks from a block's end until its answer's speeds are reached."""
        if self.base.acceleration_m_s2 is None:
            return self.effect_ticks
        change_m_s = self.base.wheel_m_s(after[0] - before[0], after[1] - before[1])
        return self.effect_ticks + math.ceil(change_m_s / self.base.acceleration_m_s2 / TICK_S)

    def sweeps(self, v_m_s: float, omega_rad_s: float) -> bool:
        """Whether at these speeds the tips go over the floor as they do when driving straight."""
        return v_m_s == self.explore_m_s or abs(omega_rad_s) == self.turn_rad_s

    @property
    def push_ticks(self) -> int:
        """Ticks of the push from the onset: the angle is the same at any rate."""
        return round(PUSH_TICKS * WHISK_RAD_S / self.whisk_rad_s)


EXACT = Wheels()  # any speed, as the simulated wheels without a base have it


@dataclass(frozen=True)
class Bumps:
    """What the base feels besides its wheels' motion; `carried`: it may be anywhere, `lost`: nothing is heard from it."""

    left: bool = False
    right: bool = False
    cliff_left: bool = False
    cliff_right: bool = False
    wheel_drop: bool = False
    carried: bool = False
    lost: bool = False

    @classmethod
    def of_bits(cls, bits: int) -> "Bumps":
        """The flags that the bits of whisker-base's odometry messages stand for."""
        return cls(
            left=bool(bits & base.BUMP_LEFT),
            right=bool(bits & base.BUMP_RIGHT),
            cliff_left=bool(bits & (base.CLIFF_LEFT | base.CLIFF_FRONT_LEFT)),
            cliff_right=bool(bits & (base.CLIFF_RIGHT | base.CLIFF_FRONT_RIGHT)),
            wheel_drop=bool(bits & (base.DROP_LEFT | base.DROP_RIGHT | base.DROP_CASTER)),
            carried=bool(bits & base.CARRIED),
            lost=bool(bits & base.IDLE),
        )

    @property
    def bumped(self) -> bool:
        return self.left or self.right

    @property
    def cliff(self) -> bool:
        return self.cliff_left or self.cliff_right

    @property
    def adrift(self) -> bool:
        """The wheels do not move the robot, or nobody knows."""
        return self.wheel_drop or self.lost

    @property
    def side(self) -> float:
        """+1: what is in the way is on the left, -1: right, 0: ahead or nothing."""
        return float(self.left or self.cliff_left) - float(self.right or self.cliff_right)


NO_BUMPS = Bumps()
