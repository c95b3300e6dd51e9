"""The robot's process table: what runs on the netbook, what on the desktop, and what stands in for the hardware."""

import signal
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from ...programs import program
from ..policy import RANDOM
from .children import Program

FIRST_PORT = 7457  # of three: supervisor, pilot, navigator; the latter two are those of robot.link
LOOPBACK = "127.0.0.1"
BRIDGE, NAVIGATOR, MAPPER = "bridge", "navigator", "mapper"

SIMULATED_BASE = "crunchbot_lab.simulation.ros2_base"
BASE_STEADY_S = 1.0  # a base that is started again stops the wheels: it comes at once

# Inside the simulated bridge's umockdev the device is seen by a process that has these variables: they are left in file $0. At
# the end the process that took it ends first, for umockdev does not survive a client that is left. When the supervisor has died
# the world goes on for a second: a real one does not end with the robot's processes, and a base has to stop its wheels.
# Each sleep is short, because it goes on when the shell is killed.
LEAVE_ENVIRONMENT = """
end() {
    rm -f "$0"
    kill $! 2>/dev/null
    pid=$(cat "$0.pid" 2>/dev/null) && kill "$pid" 2>/dev/null && while kill -0 "$pid" 2>/dev/null; do sleep 0.05; done
    exit 0
}
trap end TERM
trap 'sleep 1; end' URG
export -p | grep -E '^export (LD_PRELOAD|UMOCKDEV_DIR)=' >"$0.new" && mv "$0.new" "$0"
while :; do sleep 1 & wait $!; done
"""
# Waits for them, and becomes the command with them; its other variables stay its own.
WITH_ENVIRONMENT = 'while [ ! -e "$0" ]; do sleep 0.1; done; . "$0"; echo $$ >"$0.pid"; exec "$@"'


@dataclass(frozen=True)
class Places:
    """Where the processes of one machine meet: a ring, and a folder of sockets."""

    ring: str
    folder: Path

    @property
    def reading(self) -> list:
        """Options of what reads the ring."""
        return ["--ring", self.ring]

    @property
    def base(self) -> Path:
        return self.folder / "base.sock"

    @property
    def create(self) -> Path:
        """Of the simulated Create that stands in for a base of ROS 2."""
        return self.folder / "create.sock"

    @property
    def simulation(self) -> Path:
        return self.folder / "sim.sock"

    @property
    def serial(self) -> Path:
        """The serial port of the simulated base."""
        return self.folder / "create"

    @property
    def checkpoint(self) -> Path:
        """The navigator's checkpoint. The folder is made for the run, so no checkpoint is older than the run."""
        return self.folder / "navigator.checkpoint"

    @property
    def journal(self) -> Path:
        """The mapper's rows; as old as the run, too."""
        return self.folder / "mapper.journal"

    @property
    def environment(self) -> Path:
        """The file with the environment of a process that is to see the simulated bridge."""
        return self.folder / "environment"


@dataclass(frozen=True)
class Meeting(Places):
    """Where processes of several machines meet: at three ports of one address, too."""

    address: str = LOOPBACK
    first_port: int = FIRST_PORT
    zenoh_config: Path | None = None  # with it they meet by TLS

    def endpoint(self, number: int) -> str:
        """0: the supervisor's, 1: the pilot's, 2: the navigator's."""
        return f"{'tls' if self.zenoh_config else 'tcp'}/{self.address}:{self.first_port + number}"

    @property
    def options(self) -> list:
        """What every process that meets others is given besides endpoints."""
        return ["--zenoh-config", self.zenoh_config] if self.zenoh_config else []


@dataclass(frozen=True)
class Body:
    """The robot: its scene folder, its models, and the base: Create 1 or 2 on a serial port, or one of ROS 2."""

    scene: Path
    models: Path
    create: int | None  # None: wheels that obey at once, without a serial line
    port: Path
    seed: int  # of the random turns
    choose: str = RANDOM  # what takes their place, of `policy`
    ros2: bool = False  # the base is that of robot.toml, by ROS 2; a simulated one is the Create in its place


def whisker(command: str) -> list[str]:
    """How a command of `whisker` begins."""
    return [sys.executable, "-m", "crunchbot.cli", command]


class Table:
    """The command of each process, for every way to run them: what is said here holds in all; a way adds its own options.

    `find` gives the path of a compiled program.
    """

    def __init__(self, body: Body, places: Places, find: Callable[[str], str] = program):
        self.body, self.places, self.find = body, places, find

    def daemon(self) -> list:
        return [self.find("whiskerd"), "--ring", self.places.ring]

    def base(self) -> list:
        if self.body.ros2:
            return [*whisker("base"), self.body.scene, "--socket", self.places.base]
        return self.create(self.places.base)

    def create(self, socket: Path) -> list:
        paths = ["--port", self.body.port, "--socket", socket]
        return [self.find("whisker-base"), *paths, "--model", self.body.create]

    def simulated_base(self) -> list:
        """What makes a base of ROS 2 of the simulated Create."""
        return [sys.executable, "-m", SIMULATED_BASE, self.body.scene, "--base", self.places.create]

    def pilot(self) -> list:
        body = self.body
        pilot = [*whisker("pilot"), body.scene, "--models", body.models, "--seed", body.seed, *self.places.reading]
        return pilot if body.choose == RANDOM else [*pilot, "--choose", body.choose]

    def navigator(self) -> list:
        return [*whisker("navigator"), self.body.scene]

    def mapper(self, out: Path) -> list:
        return [*whisker("mapper"), self.body.scene, "--out", out, "--overwrite"]

    def bag(self, file: Path) -> list:
        return [*whisker("bag"), file, "--scene", self.body.scene]

    def bridge(self, simulated: "Simulated") -> list:
        """The simulation; what runs beside it is given behind `--`."""
        command = [self.find("umockdev-wrapper"), self.find("whisker-bridge-sim"), "--scene", simulated.flat]
        command += ["--seed", simulated.seed, "--seconds", simulated.seconds, "--level", simulated.level]
        command += ["--socket", self.places.simulation, "--truth", simulated.truth]
        return command + (
            ["--create", self.body.create, "--create-link", self.places.serial] if self.body.create else []
        )


def daemon(body: Body, meeting: Meeting, simulated: bool) -> Program:
    """What fills the ring."""
    command = [*Table(body, meeting).daemon(), "--wait"]
    if simulated:
        command = ["sh", "-c", WITH_ENVIRONMENT, meeting.environment, *command]
    return Program.of("whiskerd", command)


def netbook(body: Body, meeting: Meeting, awaited: str | None) -> list[Program]:
    """Base and pilot, which waits for the process `awaited`. The pilot is the last, so that it is ended first, and stops
    the wheels."""
    table = Table(body, meeting)
    pilot = [*table.pilot(), "--base", meeting.base, "--listen", meeting.endpoint(1), "--connect", meeting.endpoint(2)]
    pilot += [*meeting.options, *(["--await", awaited] if awaited else [])]
    return [
        _base_program("base", table.base(), body.ros2),
        Program.of("pilot", pilot, reports=True, moves=True),
    ]


def _base_program(name: str, command: list, ros2: bool) -> Program:
    """ros2: its driver watches its guard, which feeds no watchdog."""
    waiting = [] if ros2 else ["--wait"]
    return Program.of(name, command + waiting, moves=True, fed=not ros2, steady_s=BASE_STEADY_S)


def simulated_base(body: Body, meeting: Meeting) -> list[Program]:
    """A base of ROS 2 in place of the simulated Create."""
    table = Table(body, meeting)
    create = _base_program("create", table.create(meeting.create), ros2=False)
    return [create, Program.of("simulated-base", table.simulated_base(), serves=True)]


def desktop(
    body: Body, meeting: Meeting, bag: Path | None, view_port: int | None, map_folder: Path | None = None
) -> list[Program]:
    """Navigator, or a mapper in its place that writes `map_folder`; and, where they are wanted, bag and view."""
    commands = Table(body, meeting)
    if map_folder:
        name, command = MAPPER, [*commands.mapper(map_folder), "--journal", meeting.journal]
    else:
        name, command = NAVIGATOR, [*commands.navigator(), "--checkpoint", meeting.checkpoint]
    command += ["--stay", "--listen", meeting.endpoint(2), "--connect", meeting.endpoint(1), *meeting.options]
    table = [Program.of(name, command, reports=True)]
    everybody = [word for number in range(3) for word in ("--connect", meeting.endpoint(number))] + meeting.options
    if bag:
        table.append(Program.of("bag", [*commands.bag(bag), "--stay", "--next", *everybody], reports=True))
    if view_port is not None:
        command = [*whisker("view"), *meeting.reading, "--robot", "--scene", body.scene, "--port", view_port]
        command += ["--records", bag.parent] if bag else []
        table.append(Program.of("view", [*command, *everybody]))
    return table


@dataclass(frozen=True)
class Simulated:
    """What stands in for arena, whiskers, bridge and base. `flat`: the scene as the simulation reads it."""

    flat: Path
    level: str  # rtl or bytes
    seed: int
    seconds: float
    pace: float | None  # simulated seconds per second; None: as fast as frames are taken
    truth: Path
    wheels: Path | None = None  # what the base's wheels were ordered


def bridge(simulated: Simulated, body: Body, meeting: Meeting) -> Program:
    """The simulation, at the wall's pace; whiskerd is started beside it."""
    command = [*Table(body, meeting).bridge(simulated), "--pace", simulated.pace, "--wheels", simulated.wheels]
    command += ["--", "sh", "-c", LEAVE_ENVIRONMENT, meeting.environment]
    return Program.of(BRIDGE, command, orphaned=signal.SIGURG)  # the simulation takes no notice of it, its command does
