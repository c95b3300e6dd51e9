"""What a base can do and what it reports beside odometry, whatever its make."""

from dataclasses import dataclass

from . import base
from .states import BACK_OFF_M_S, EFFECT_TICKS, PUSH_TICKS, WHISK_RAD_S


@dataclass(frozen=True)
class Wheels:
    """Speeds of the body whisk (rad/s) and of slow backing off (m/s); ticks from a block's end to its answer's effect."""

    whisk_rad_s: float = WHISK_RAD_S
    back_off_m_s: float = BACK_OFF_M_S
    effect_ticks: int = EFFECT_TICKS

    @classmethod
    def stepped(cls, step_m_s: float, track_m: float, effect_ticks: int = EFFECT_TICKS) -> "Wheels":
        """The wheels of a base whose speeds are multiples of `step_m_s`: the nearest to the paper's that move at all."""

        def nearest(wheel_m_s: float) -> float:
            return step_m_s * max(1, round(wheel_m_s / step_m_s))

        return cls(2.0 * nearest(WHISK_RAD_S * track_m / 2.0) / track_m, nearest(BACK_OFF_M_S), effect_ticks)

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
