"""The simulated bridge from Python: its scenes, faults, and a course for its robot."""

import socket
import threading
import time
from dataclasses import replace
from pathlib import Path

from crunchbot.errors import UserError
from crunchbot.files import UnreadableError, read_toml
from crunchbot.pilot.behaviour import WHISK_RAD_S
from crunchbot.scene import Prior, Scene, in_arena, load
from whisker_protocol import LIMITS, SENSOR_ERRORS

from .scenes import MECHANICS, SENSORS, START_CLEARANCE_M, make_scene, simulated

BLOCK_TICKS = 40  # the robot is given one order per block (sim/robot/pilot_answers.h)
BLOCK_S = BLOCK_TICKS * LIMITS["tick_period"] / LIMITS["clock_hz"]
AHEAD_BLOCKS = 25  # orders given in advance: half a second, so that pacing is smooth
TURN_RAD_S = 0.5  # a floor whisker's tip then goes at 0.1 m/s
# What a robot does over and over: (seconds, rad/s). `whisk`: body whisks to either side, rest before each pair.
COURSES = {
    "turn": ((1.0, TURN_RAD_S),),
    "still": ((1.0, 0.0),),
    "whisk": ((0.6, 0.0), (0.8, WHISK_RAD_S), (1.6, -WHISK_RAD_S), (0.8, WHISK_RAD_S)),
}

LASTING = ("sensor_dead", "sensor_frozen", "link_dead")  # kinds of faults that may last


class SimulationError(UserError):
    """The simulated bridge cannot be started as asked; one line."""


def simulated_scene(
    folder: str | None, seed: int, mechanics: str = MECHANICS[0], sensor: str = SENSORS[0]
) -> tuple[Scene, tuple[float, float, float]]:
    """(scene, start pose): of this folder, or the demo's of this seed.

    `mechanics`: how its whiskers bend; `sensor`: what reads them; which ones they are is the seed's. Models are to be learnt from this very scene.
    """
    if folder is None:
        return make_scene(seed, mechanics, sensor)
    scene = replace(load(folder), simulated=simulated(mechanics, seed, sensor))
    return scene, _start(scene, folder)


def flat_scene(
    folder: str | None, seed: int, mechanics: str = MECHANICS[0], sensor: str = SENSORS[0]
) -> tuple[str, int]:
    """(a simulated scene as the simulation reads it, number of whiskers)."""
    scene, start = simulated_scene(folder, seed, mechanics, sensor)
    return scene.flat(start), len(scene.robot.whiskers)


def _start(scene: Scene, folder: str) -> tuple[float, float, float]:
    """In the arena's frame: the prior's mean if the robot fits there, else the free place nearest to the arena's middle."""
    free = scene.arena.is_free
    radius = scene.robot.body_radius_m
    mean = in_arena(scene.prior or Prior("uniform"), scene.origin).mean
    if mean and free(mean[0], mean[1], radius):
        return mean
    width, height = scene.arena.size_m
    places = [(x * width / 50, y * height / 50) for x in range(51) for y in range(51)]
    places.sort(key=lambda p: (p[0] - width / 2) ** 2 + (p[1] - height / 2) ** 2)
    for clearance in (START_CLEARANCE_M, radius):
        for x, y in places:
            if free(x, y, clearance):
                return x, y, 0.0
    raise SimulationError(f"{folder}: no place where the robot fits; make the arena larger or take obstacles away")


def read_faults(path: str, ticks_per_s: int) -> str:
    """The faults of a TOML file as the simulation reads them. SimulationError: file, which fault, remedy."""
    try:
        _, content = read_toml(path)
    except UnreadableError as error:
        raise SimulationError(f"{path}: {error}; give a TOML file of [[fault]] tables") from error
    entries = content.get("fault")
    if set(content) != {"fault"} or not isinstance(entries, list):
        raise SimulationError(f"{path}: give [[fault]] tables and nothing else")
    lines = []
    for number, entry in enumerate(entries, start=1):
        try:
            lines.append(_fault(entry, ticks_per_s))
        except ValueError as error:
            raise SimulationError(f"{path}, fault {number}: {error}") from error
    return "".join(line + "\n" for _, line in sorted(lines))


def _fault(entry: dict, ticks_per_s: int) -> tuple[int, str]:
    """(tick, line) of one fault; ValueError says what is wrong with it."""
    if not isinstance(entry, dict):
        raise ValueError("is no table; write it as [[fault]]")
    unknown = set(entry) - {"tick", "t_s", "kind", "lane", "bit", "error", "until", "until_s"}
    if unknown:
        raise ValueError(f"'{min(unknown)}' is no key; use tick or t_s, until or until_s, kind, lane, bit, error")
    if ("tick" in entry) == ("t_s" in entry):
        raise ValueError("give either tick or t_s")
    tick = _number(entry, "tick") if "tick" in entry else round(_number(entry, "t_s", float) * ticks_per_s)
    lasts = "until" in entry or "until_s" in entry
    kind = entry.get("kind")
    if not isinstance(kind, str) or not kind.isidentifier():
        raise ValueError('kind is missing; give it as in kind = "link_flip"')
    if lasts or kind == "sensor_frozen":
        return tick, f"lasting {tick} {_until(entry, tick, ticks_per_s)} {_number(entry, 'lane')} {_lasting(kind)}"
    if "lane" not in entry:
        return tick, f"usb {tick} {kind}"
    return tick, f"lane {tick} {_number(entry, 'lane')} {kind} {_argument(entry)}"


def _until(entry: dict, tick: int, ticks_per_s: int) -> int:
    """The tick of the first record that is well again."""
    if entry.get("until") == "end":
        return 2**64 - 1
    if ("until" in entry) == ("until_s" in entry):
        raise ValueError('give until, a tick or "end", or until_s')
    until = _number(entry, "until") if "until" in entry else round(_number(entry, "until_s", float) * ticks_per_s)
    if until <= tick:
        raise ValueError("until is not after the fault's beginning; give a later one")
    return until


def _lasting(kind: str) -> str:
    if kind not in LASTING:
        raise ValueError(f"{kind} does not last; leave out until, or use one of {', '.join(LASTING)}")
    return kind


def _argument(entry: dict) -> int:
    """The bit a flip turns, or the sensor's error word."""
    if "error" not in entry:
        return _number(entry, "bit") if "bit" in entry else 0
    if not isinstance(entry["error"], str) or entry["error"] not in SENSOR_ERRORS:
        raise ValueError(f"error {entry['error']!r:.40} is none; use one of {', '.join(SENSOR_ERRORS)}")
    return 1 << SENSOR_ERRORS[entry["error"]]["sensor_bit"]


def _number(entry: dict, key: str, kind: type = int) -> float:
    value = entry.get(key)
    if isinstance(value, bool) or not isinstance(value, int | kind) or not 0 <= value < 2**32:
        raise ValueError(f"{key} is no {'whole ' if kind is int else ''}number from 0; give one")
    return value


def turns(drive: str) -> list[float]:
    """A course of COURSES, an order a block of ticks (rad/s)."""
    return [turn for seconds, turn in COURSES[drive] for _ in range(round(seconds / BLOCK_S))]


class Course(threading.Thread):
    """Drives the simulated robot and keeps its time to the wall's: the simulation waits for orders."""

    def __init__(self, path: Path, drive: str, pace: float, stop: threading.Event):
        """`drive`: one of COURSES; `pace`: simulated seconds per second; 0: no limit."""
        super().__init__(daemon=True)
        self._path, self._stop_event = path, stop
        self._turns = turns(drive)
        self._block_s = BLOCK_S / pace if pace > 0 else 0.0

    def run(self) -> None:
        """Order by order until the simulation or its user has had enough."""
        with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as link:
            while link.connect_ex(str(self._path)) != 0:
                if self._stop_event.wait(0.02):
                    return
            try:
                link.send(b"pilot")
                self._orders(link)
            except OSError:
                return  # the simulation has ended

    def _orders(self, link: socket.socket) -> None:
        began, block, passed = time.monotonic(), 0, 0
        while not self._stop_event.is_set():
            while block < passed + AHEAD_BLOCKS:
                block += 1
                turn = self._turns[(block - 1) % len(self._turns)]
                link.send(f"drive {block * BLOCK_TICKS - 1} 0 {turn}".encode())
            message = link.recv(256).split()
            if not message or message[0] == b"end":
                return
            passed = (int(message[1]) + 1) // BLOCK_TICKS
            self._stop_event.wait(max(0.0, began + passed * self._block_s - time.monotonic()))
