"""The robot under drill: its process table with the relays in it, kept by the project's own supervisor."""

import os
import signal
import socket
import threading
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

from crunchbot import scene as scenes
from crunchbot.pilot.base import Base, BaseError
from crunchbot.robot.network.link import Link
from crunchbot.robot.network.truth import TruthWatcher
from crunchbot.robot.processes import parts
from crunchbot.robot.processes.logs import run_folder
from crunchbot.robot.processes.supervisor import Supervisor
from crunchbot_lab.simulation.scenes import make_scene

from .relays import Hands, Line, Network, free_ports

CROSSED = 3  # behind the three ports of the processes: those of the relays to them
PILOT, NAVIGATOR = 1, 2
VIEW = 6
PORTS = 7


@dataclass(frozen=True)
class Side(parts.Meeting):
    """One side of the network: what is on the other side is reached through a relay."""

    crossing: int = -1

    def endpoint(self, number: int) -> str:
        return super().endpoint(number + CROSSED * (number == self.crossing))


@dataclass(frozen=True)
class Plan:
    """What is drilled: out: folder of all files; models: of this seed's robot."""

    out: Path
    models: Path
    seed: int
    seconds: float
    level: str = "bytes"
    create: int = 1
    pace: float = 1.0


class Machine:
    """The processes, where they meet, and what can be done to them."""

    def __init__(self, plan: Plan):
        self.plan, self._folder = plan, plan.out / "meeting"
        self._folder.mkdir(parents=True, exist_ok=True)
        self.first_port = free_ports(PORTS)
        ring = f"whisker-drill-{os.getpid()}"
        self._netbook, self._desktop = (
            Side(ring, self._folder, first_port=self.first_port, crossing=crossing) for crossing in (NAVIGATOR, PILOT)
        )
        self.ring, self.base_socket, self.simulation = ring, self._netbook.base, self._netbook.simulation
        self.wheels, self.spoilt = plan.out / "wheels.csv", plan.out / "spoilt.csv"
        self.bags, self.view_port = plan.out / "bag", self.first_port + VIEW
        self.bags.mkdir(exist_ok=True)
        scene, start = make_scene(plan.seed)
        scenes.write(plan.out / "scene", scene)
        (plan.out / "scene.flat").write_text(scene.flat(start))
        line = Line(self._netbook.serial, self._folder / "line", plan.seed)
        routes = {self.first_port + CROSSED + n: self.first_port + n for n in (PILOT, NAVIGATOR)}
        self.hands = Hands(Network(routes), line)
        self._supervisor: Supervisor | None = None

    def endpoints(self) -> list[str]:
        """Of supervisor, pilot and navigator, past the relays."""
        return [f"tcp/{parts.LOOPBACK}:{self.first_port + n}" for n in range(3)]

    def table(self) -> list:
        plan = self.plan
        body = parts.Body(plan.out / "scene", plan.models, plan.create, self._folder / "line", plan.seed)
        stands_in = parts.Simulated(
            plan.out / "scene.flat", plan.level, plan.seed, plan.seconds, plan.pace, plan.out / "truth.csv", self.wheels
        )
        bridge = parts.bridge(stands_in, body, self._netbook)
        none = plan.out / "no-faults"
        none.write_text("")
        more = ("--fault-list", none, "--faults", self.spoilt)
        cut = bridge.command.index("--")
        bridge = replace(bridge, command=(*bridge.command[:cut], *map(str, more), *bridge.command[cut:]))
        desktop = parts.desktop(body, self._desktop, self.bags / "robot.mcap", self.view_port)
        daemon = parts.daemon(body, self._netbook, simulated=True)
        return [bridge, *desktop, daemon, *parts.netbook(body, self._netbook, parts.NAVIGATOR)]

    @contextmanager
    def running(self):
        """All of it, until the end of the block. The wheels are stopped then."""
        stop = threading.Event()
        self.hands.start()
        with Link("supervisor", listen=self.endpoints()[:1]) as link:
            TruthWatcher(self.simulation, link, stop).start()
            self._supervisor = Supervisor(self.table(), run_folder(self.plan.out / "logs"), link, parts.BRIDGE)
            thread = threading.Thread(target=self._supervisor.run, args=(stop,))
            thread.start()
            try:
                yield
            finally:
                stop.set()
                thread.join()
                self.hands.end()

    @property
    def over(self) -> bool:
        """The simulation has ended."""
        return self.pid(parts.BRIDGE) == 0

    def pid(self, name: str) -> int:
        """Of a process of the table, 0 while it does not run; `driver`: the guard's child."""
        if name == "driver":
            return int(self.base_health().get("driver_pid", 0))
        return self._supervisor.pid(name)

    def base_health(self) -> dict[str, str]:
        """What whisker-base reports to an observer; empty: it does not answer."""
        try:
            with Base(str(self.base_socket)) as base:
                return base.health()
        except BaseError:
            return {}

    def kill(self, name: str) -> None:
        os.kill(self.pid(name), signal.SIGKILL)

    def report_simulation(self, text: str) -> None:
        """One message to the simulation, whose connection then ends."""
        with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as link:
            link.connect(str(self.simulation))
            link.send(text.encode())
