"""The driver's process: odometry in, orders out, a socket for clients. `python -m crunchbot.robot.rosbase.driver` by its guard."""

import os
import socket
import sys
import time
from pathlib import Path

from ... import scene as scenes
from ...ends import exit_code
from ...errors import UserError
from ...pilot import base as bits
from ...stamping import stamp_output
from ...stopping import stop_on_signals
from . import ALIVE_S, DRIVING, LEASE, LEASE_S, LOOK_S, SILENCE_S, STANDING
from .clients import Clients
from .drive import Drive
from .motion import Judge
from .signing import why_untrusted
from .wire import Wire

GRAPH_S = 0.1  # between two looks at who takes orders
LINES_MOST, LINES_S = 5, 60.0  # lines of a kind in the log, in this time
BITS = {
    "bump_left": bits.BUMP_LEFT,
    "bump_right": bits.BUMP_RIGHT,
    "cliff_left": bits.CLIFF_LEFT,
    "cliff_right": bits.CLIFF_RIGHT,
    "wheel_drop": bits.DROP_LEFT | bits.DROP_RIGHT | bits.CARRIED,
}
STOPPING = bits.CLIFF_LEFT | bits.CLIFF_RIGHT | bits.DROP_LEFT | bits.DROP_RIGHT


class Teller:
    """Lines on standard error, few of each text in a minute."""

    def __init__(self):
        self._told: dict[str, list[float]] = {}

    def __call__(self, line: str) -> None:
        now_s = time.monotonic()
        recent = [one for one in self._told.get(line, []) if now_s - one < LINES_S]
        if len(recent) < LINES_MOST:
            print(f"whisker base: {line}", file=sys.stderr, flush=True)
            recent.append(now_s)
        self._told[line] = recent


class Driver:
    def __init__(self, scene: Path, domain: int, reach: str, guard: socket.socket, listening: socket.socket):
        robot, self._guard, self._tell = scenes.load_robot(scene), guard, Teller()
        self._base = robot.base
        self._wire = Wire(robot.base.topics, domain, reach)
        self._drive = Drive(robot.base, self._wire.send, self._tell)
        self._judge = Judge(robot.base, robot.odometry_relative_sigma)
        self._touched, self._heard, self._guard_pid = 0, 0, os.getppid()
        untrusted = why_untrusted(scene, robot.base.topics)
        self._clients = Clients(listening, self._drive, self._bits, self._health, untrusted)
        self._looked_s = self._alive_s = float("-inf")
        self._told_covariance, self._odometry_s = False, float("-inf")
        if untrusted:
            self._tell(untrusted)

    def run(self, stop) -> int:
        """Until it is asked to end, or the guard has died; the wheels have been stopped, and the stop repeated."""
        code = 0
        while not stop.is_set():
            if not self._take_lease():
                self._tell("the guard has died; ending")
                code = 1
                break
            self._turn()
        self._end()
        return code

    def _turn(self) -> None:
        now_s = time.monotonic()
        if now_s - self._looked_s >= GRAPH_S:
            self._looked_s, self._drive.is_heard = now_s, self._wire.look()
        self._take_odometry()
        self._take_touches(now_s)
        self._drive.step(time.monotonic())
        self._clients.serve(LOOK_S)
        self._drive.step(time.monotonic())
        self._say_alive()

    def _end(self) -> None:
        """Zero is repeated, for a base may have missed it; not for as long as else, for who presses Ctrl-C waits."""
        begin_s = time.monotonic()
        self._drive.stop(begin_s)
        while self._drive.ending(now_s := time.monotonic()) and now_s - begin_s < SILENCE_S:
            self._drive.step(now_s)
            self._say_alive()
            time.sleep(LOOK_S)

    def _take_odometry(self) -> None:
        for said in self._wire.odometry():
            self._heard += 1
            if said.arrived_s - self._odometry_s >= SILENCE_S:
                self._tell("odometry comes")
            self._odometry_s = self._drive.heard_s = said.arrived_s
            carried, resets = self._judge.carried, self._judge.resets
            for step in self._judge.take(said, self._drive.fetch_asked()):
                self._clients.add(step)
            if self._judge.carried > carried:
                self._clients.note(bits.CARRIED)
                self._tell("the odometry leapt by more than the base can drive: it was carried, or set anew")
            if self._judge.resets > resets:
                self._tell("the odometry was set anew; its twist counts")
        if self._judge.covariance == "assumed" and not self._told_covariance:
            self._told_covariance = True
            self._tell(
                "the odometry's covariance does not grow with its motion; robot.toml's relative error counts alone"
            )

    def _take_touches(self, now_s: float) -> None:
        for name, is_touched in self._wire.touches():
            bit = BITS[name]
            if is_touched and not self._touched & bit:
                self._clients.note(bit)
                if bit & STOPPING:
                    self._drive.touched(now_s)
            self._touched = self._touched | bit if is_touched else self._touched & ~bit

    def _bits(self) -> int:
        return self._touched

    def _take_lease(self) -> bool:
        """The guard's newest word. False: the guard has died."""
        while True:
            try:
                data = self._guard.recv(LEASE.size)
            except BlockingIOError:
                return True
            except OSError:
                return False
            if len(data) != LEASE.size:
                return False
            self._drive.lease_s = min(LEASE.unpack(data)[0], time.monotonic() + LEASE_S)

    def _say_alive(self) -> None:
        now_s = time.monotonic()
        if now_s - self._alive_s >= ALIVE_S:
            self._alive_s = now_s
            try:
                self._guard.send(DRIVING if self._drive.driving else STANDING)
            except OSError:  # it hangs, or has died: its lease says so
                return

    def _health(self) -> dict[str, object]:
        now_s, base = time.monotonic(), self._base
        return {
            "model": "ros2",
            "wheel_base_m": base.wheel_base_m,
            "wheel_most_m_s": base.wheel_most_m_s,
            "speed_step_m_s": base.wheel_step_m_s,
            "mode": self._drive.mode,
            "held": self._drive.held(now_s),
            "orders": "heard" if self._drive.is_heard else "unheard",
            "command_type": self._wire.kind or "unknown",
            "v_m_s": self._drive.ordered[0],
            "omega_rad_s": self._drive.ordered[1],
            "covariance": self._judge.covariance,
            "messages": self._heard,
            "refused": self._wire.refused,
            "resets": self._judge.resets,
            "carried": self._judge.carried,
            "commander_stops": self._drive.stops,
            "driver_pid": os.getpid(),
            "guard_pid": self._guard_pid,
        }


def main(words: list[str]) -> int:
    """SCENE DOMAIN RANGE GUARD LISTENING: the last two are descriptors."""
    scene, domain, reach, guard, listening = words
    stop = stop_on_signals()
    try:
        sockets = [socket.socket(fileno=int(number)) for number in (guard, listening)]
    except (OSError, ValueError):
        raise UserError("driver: is started by `whisker base`; start that") from None
    for one in sockets:
        one.setblocking(False)
    return Driver(Path(scene), int(domain), reach, *sockets).run(stop)


if __name__ == "__main__":
    stamp_output()
    sys.exit(exit_code("whisker base", lambda: main(sys.argv[1:])))
