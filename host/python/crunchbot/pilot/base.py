"""The robot's base: client of `whisker-base`, which drives an iRobot Create, and of `whisker base`, for one of ROS 2.

One ASCII message per packet over a Unix socket, one answer each; docs/create.md has them all. The first client that drives
commands; any number may observe. A commander that is silent for 0.3 s, or goes, finds the wheels stopped; after 1 s another
client may command.
"""

import socket
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from ..errors import UserError

ANSWER_BYTES = 4096

# Bits of an odometry message: what was true at some time since the message before it.
BUMP_RIGHT, BUMP_LEFT, DROP_RIGHT, DROP_LEFT, DROP_CASTER = (1 << n for n in range(5))
CLIFF_LEFT, CLIFF_FRONT_LEFT, CLIFF_FRONT_RIGHT, CLIFF_RIGHT = (1 << n for n in range(5, 9))
CARRIED = 1 << 10  # what no wheel can have done: it was lifted, pushed, or the line is bad
IDLE = 1 << 9  # wheels will not turn: not in its mode, silent, held (see `health()`), or the port is gone


class BaseError(UserError):
    """whisker-base refused a message."""

    exit_code = 1


class BaseLost(BaseError):
    """There is no whisker-base at the other end any more. Where only its driver died another is there at once: connect anew."""


@dataclass(frozen=True)
class Sent:
    """What became of an order."""

    byte_count: int  # written to the port since it was opened; 0: the port is gone
    v_m_s: float  # speeds really ordered: those that this base's wheels can do
    omega_rad_s: float


@dataclass(frozen=True)
class Motion:
    """Motion since this client's last one, in the robot's frame at that time."""

    x_m: float
    y_m: float
    theta_rad: float  # anticlockwise, not wrapped
    covariance: tuple[tuple[float, float, float], ...]  # of x, y, theta: m^2, m rad, rad^2
    bits: int  # BUMP_LEFT, ...


class Base:
    """A connection to whisker-base. Use as a context manager.

    `after=N` (lock-step simulation): whisker-base first takes in the base's answers up to byte N, and none beyond.
    BaseLost when an answer takes longer than `timeout_s`; None: it is waited for, however long.
    """

    def __init__(self, path: str, timeout_s: float | None = None):
        self._path = path
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._socket.settimeout(timeout_s)
        try:
            self._socket.connect(path)
        except OSError as error:
            self._socket.close()
            raise BaseLost(f"{path}: {error.strerror or error}; start whisker-base --socket {path} first") from error

    def __enter__(self):
        return self

    def __exit__(self, *exception):
        self.close()

    def close(self) -> None:
        """Ends the connection; a commander's wheels stop."""
        self._socket.close()

    def fileno(self) -> int:
        """Descriptor, to wait on."""
        return self._socket.fileno()

    def drive(self, v_m_s: float, omega_rad_s: float, after: int | None = None) -> Sent:
        """Drives forward at v and turns anticlockwise at omega, until the next order or for 0.3 s."""
        return self._sent(f"drive {v_m_s!r} {omega_rad_s!r}", after)

    def stop(self, after: int | None = None) -> Sent:
        """Stops the wheels; any client may."""
        return self._sent("stop", after)

    def mode(self, name: str) -> Sent:
        """Stops, then enters "safe" or "full" mode again after the base has left it, or lets go ("passive")."""
        return self._sent(f"mode {name}", None)

    def odometry(self, after: int | None = None) -> Motion:
        """Motion since this client's last call, or since it connected."""
        return self._ask("odometry", "odometry", after, _motion)

    def health(self) -> dict[str, str]:
        """Counters and state, by name; docs/create.md says what they mean."""
        return self._ask("health", "health", None, lambda *pairs: dict(pair.split("=", 1) for pair in pairs))

    def _sent(self, message: str, after: int | None) -> Sent:
        return self._ask(message, "sent", after, lambda count, v, omega: Sent(int(count), float(v), float(omega)))

    def _ask(self, message: str, expected: str, after: int | None, made: Callable[..., Any]) -> Any:
        """What `made` makes of the words of an answer."""
        try:
            self._socket.send((message if after is None else f"{message} after {after}").encode())
            answer = self._socket.recv(ANSWER_BYTES)
        except OSError as error:
            raise self._lost() from error
        if not answer:
            raise self._lost()
        word, *rest = answer.decode(errors="replace").split() or [""]
        if word != expected:
            raise BaseError(f"{self._path}: {' '.join(rest)}")
        try:
            return made(*rest)
        except (TypeError, ValueError):
            text = f"an answer that is none ({' '.join(rest):.40}); use a whisker-base of this release"
            raise BaseError(f"{self._path}: {text}") from None

    def _lost(self) -> BaseLost:
        return BaseLost(f"{self._path}: whisker-base has gone or hangs; look at its log, connect again")


def _motion(*words: str) -> Motion:
    *numbers, bits = words
    x, y, theta, xx, xy, xt, yy, yt, tt = map(float, numbers)
    return Motion(x, y, theta, ((xx, xy, xt), (xy, yy, yt), (xt, yt, tt)), int(bits))
