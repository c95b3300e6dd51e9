"""What is ordered of the wheels, and what stops them: no input and output, times in s from the caller.

While a commander drives the newest order is repeated. When driving ends, for whatever reason, an order of speed zero is
sent at once and repeated for a while; then nothing is sent, for others may drive this base, too.
"""

from collections.abc import Callable

from ...base_table import BaseTable
from . import ALIVE_S, COMMANDER_S, LOOK_S, REPEAT_S, SILENCE_S

MODES = ("passive", "safe", "full")
STILL = (0.0, 0.0)


class Drive:
    """send: puts speeds on the wire, False where nobody takes them; tell: a line for the log."""

    def __init__(self, base: BaseTable, send: Callable[[float, float], bool], tell: Callable[[str], None]):
        self.mode, self.left = "safe", False  # left: something was touched at which a base in safe mode stops
        self.sent, self.ordered, self.asked = 0, STILL, STILL  # asked: the fastest order since it was last fetched
        self.stops = 0  # of a commander that was silent
        self.lease_s = self.heard_s = float("-inf")
        self.is_heard = False  # somebody takes the orders
        self._base, self._send, self._tell = base, send, tell
        self._wanted, self._commanded_s, self._sent_s, self._end_s = STILL, 0.0, float("-inf"), float("-inf")

    @property
    def driving(self) -> bool:
        return self._wanted != STILL

    def ending(self, now_s: float) -> bool:
        """Whether orders of speed zero are still to be repeated."""
        return now_s < self._end_s

    def held(self, now_s: float) -> str:
        """Why the wheels are kept stopped; "no": they are not."""
        reasons = {
            "heartbeat": now_s >= self.lease_s,
            "subscriber": not self.is_heard,
            "odometry": now_s - self.heard_s >= SILENCE_S,
            "passive": self.mode == "passive",
            "touch": self.left,
        }
        return next((reason for reason, holds in reasons.items() if holds), "no")

    def drive(self, v_m_s: float, omega_rad_s: float, now_s: float) -> None:
        wanted = self._base.reached(v_m_s, omega_rad_s)
        if wanted == STILL or self.held(now_s) != "no":
            self.stop(now_s)
            return
        self._wanted, self._commanded_s, self._end_s = wanted, now_s, float("-inf")
        self.step(now_s)

    def stop(self, now_s: float) -> None:
        if self.driving:
            self._wanted, self._end_s = STILL, now_s + REPEAT_S
            self._put(STILL, now_s)

    def set_mode(self, name: str, now_s: float) -> None:
        self.stop(now_s)
        self.mode, self.left = name, False

    def touched(self, now_s: float) -> None:
        """A cliff or a dropped wheel: as with a Create in safe mode, until the commander says `mode safe`."""
        if self.mode == "safe" and not self.left:
            self.left = True
            self.stop(now_s)
            self._tell("a cliff, or a wheel dropped; wheels stopped; move it, then send `mode safe`")

    def step(self, now_s: float) -> None:
        """What time brings."""
        reason = self.held(now_s)
        if self.driving and reason != "no":
            seen = reason not in ("subscriber", "odometry")
            fate = "wheels stopped" if seen else "ordered to stop, but not seen to: the wheels may turn"
            self._tell(f"held: {reason}; {fate}")
            self.stop(now_s)
        elif self.driving and now_s - self._commanded_s >= COMMANDER_S:
            self.stops += 1
            self._tell("the commander is silent; wheels stopped")
            self.stop(now_s)
        since_s = now_s - self._sent_s
        if self.driving and since_s >= (LOOK_S if self.ordered != self._wanted else ALIVE_S):
            self._put(self._ramped(min(since_s, ALIVE_S)), now_s)
        elif self.ending(now_s) and since_s >= ALIVE_S:
            self._put(STILL, now_s)

    def fetch_asked(self) -> tuple[float, float]:
        asked, self.asked = self.asked, self.ordered
        return asked

    def _ramped(self, since_s: float) -> tuple[float, float]:
        """The speeds on the way to those that are wanted, as far as the wheels' acceleration goes."""
        if self._base.acceleration_m_s2 is None:
            return self._wanted
        change = [wanted - now for wanted, now in zip(self._wanted, self.ordered, strict=True)]
        wheel_m_s = self._base.wheel_m_s(*change)
        share = min(1.0, self._base.acceleration_m_s2 * since_s / wheel_m_s) if wheel_m_s else 1.0
        return self.ordered[0] + share * change[0], self.ordered[1] + share * change[1]

    def _put(self, speeds: tuple[float, float], now_s: float) -> None:
        self.sent += self._send(*speeds)
        self.ordered, self._sent_s = speeds, now_s
        self.asked = max(self.asked, speeds, key=lambda pair: self._base.wheel_m_s(*pair))
