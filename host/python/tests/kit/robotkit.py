"""For tests of the robot's processes: one message of every topic, a cable to cut, patience."""

import contextlib
import math
import socket
import subprocess
import threading
from pathlib import Path

import numpy as np
from commandkit import command
from linkkit import free_endpoint
from patience import PATIENCE_S

from crunchbot import observation as o
from crunchbot.observation import ODOMETRY, Row
from crunchbot.robot.network import messages as m
from crunchbot.robot.network.link import Link
from crunchbot.robot.network.rows import RowPublisher


def examples() -> dict[str, object]:
    """By topic, with every field away from its default."""
    rng = np.random.default_rng(5)
    at = m.Header.at(12_345_678_901, "some frame")
    planar, full = rng.random((3, 3)), rng.random((6, 6))
    pose = m.PoseWithCovariance.planar((1.0, -2.0, 3.0), planar @ planar.T)
    velocity = m.Twist(m.Vector3(0.1, 0.2, 0.3), m.Vector3(0.4, 0.5, 0.6))
    twist = m.TwistWithCovariance(velocity, (full @ full.T).ravel())
    components = [rng.random(7).astype("f4") for _ in range(6)]
    return {
        "observation": m.Observation(
            at, 7, o.RELEASE, rng.random(3), rng.random(3), ["l_carpet", "r_mm", "é"], [0, 1, 2], [0.0, 0.0, -3.5]
        ),
        "odometry": m.Odometry(at, "base", pose, twist),
        "joints": m.JointState(at, ["a/alpha", "a/beta"], [0.5, np.nan], [1.0, 2.0], [3.0]),
        "contact": m.Contact(at, "front", True, m.Time(1, 2), m.Time(3, 4), True, 0.1, 0.005, m.SHAFT, m.CORNER),
        "behaviour": m.Behaviour(at, "forward", m.Time.of(10**10 + 1), "clear"),
        "pose": m.PoseWithCovarianceStamped(at, pose),
        "localisation": m.Localisation(at, "grid", pose, 0.75, 2**40, 2, 3, 4, 5, "uniform"),
        "belief": m.Belief(at, "grid", 9, 8, 0.875, *components),
        "map": m.OccupancyGrid(
            at,
            m.MapMetaData(m.Time(1, 2), 0.03125, 3, 2, m.Pose.planar(-0.5, 0.25, 0.0)),
            np.array([-1, 0, 50, 99, 100, 1], "i1"),
        ),
        "touch_map": m.TouchMap(
            at,
            11,
            1,
            ["VINYL", "ROUGH"],
            rng.random(4),
            np.array([-1, 0, 2], "i4"),
            np.array([1, -2, 3], "i4"),
            np.array([0, 1, 1], "u1"),
            rng.random(3).astype("f4"),
            *(rng.random(4).astype("f4") for _ in range(7)),
            *(rng.random(2).astype("f4") for _ in range(3)),
        ),
        "truth": m.PoseStamped(at, m.Pose.planar(0.5, 0.25, -1.0)),
        "health/pilot": m.ProcessHealth(at, "pilot", 4321, "running", [m.KeyValue("rows", "7")], "none yet"),
    }


def flat(message, path: str = "") -> dict[str, object]:
    """Every number and text of a message by the path of its field; ours and those of other readers alike."""
    if isinstance(message, (str, int, float, np.generic)):
        return {path: message}
    if isinstance(message, (list, tuple, np.ndarray)):
        pairs = ((f"{path}[{n}]", item) for n, item in enumerate(message))
    else:
        pairs = ((f"{path}.{name}", value) for name, value in vars(message).items() if not name.startswith("_"))
    return {key: value for name, item in pairs for key, value in flat(item, name).items()}


class Robot:
    """A pilot's link with a reader of the answers of a navigator, or of what takes its place; and these to start."""

    def __init__(self, *answers: str, lock_step: bool = True):
        self.pilot_end, self.navigator_end = free_endpoint(), free_endpoint()
        self.link = Link("pilot", listen=[self.pilot_end], connect=[self.navigator_end], lock_step=lock_step)
        self.inbox = self.link.subscribe(*answers)
        self.rows = RowPublisher(self.link)
        self._lock_step = ["--lock-step"] if lock_step else []

    def __enter__(self):
        return self

    def __exit__(self, *exception):
        self.link.close()

    @contextlib.contextmanager
    def started(self, name: str, folder: Path, *options):
        """The process `whisker name`; it is there for rows when this returns, and killed at the end if it still runs."""
        ends = ["--listen", self.navigator_end, "--connect", self.pilot_end, *self._lock_step]
        child = subprocess.Popen(command(name, folder, *ends, *options), stdout=subprocess.PIPE, text=True)
        try:
            assert self.link.wait_for([name], PATIENCE_S)
            yield child
        finally:
            child.kill()
            child.communicate()

    def send(self, rows) -> None:
        for row in rows:
            self.rows.send(Row.of(row))


class Cable:
    """A way to an endpoint that can be cut and mended: connect to `endpoint`. Use as a context manager."""

    def __init__(self, to: str):
        self._target = ("127.0.0.1", int(to.rpartition(":")[2]))
        self.endpoint = free_endpoint()
        self._ends: list[socket.socket] = []
        self._server: socket.socket | None = None

    def __enter__(self) -> "Cable":
        self.mend()
        return self

    def __exit__(self, *exception) -> None:
        self.cut()

    def mend(self) -> None:
        self._server = socket.create_server(("127.0.0.1", int(self.endpoint.rpartition(":")[2])))
        threading.Thread(target=self._serve, args=[self._server], daemon=True).start()

    def cut(self) -> None:
        """Both sides find their connection closed, and nobody to connect to."""
        for end in [self._server, *self._ends]:
            with contextlib.suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)
            end.close()
        self._ends = []

    def _serve(self, server: socket.socket) -> None:
        with contextlib.suppress(OSError):
            while True:
                near, _ = server.accept()
                try:
                    far = socket.create_connection(self._target)
                except OSError:
                    near.close()
                    continue
                self._ends += [near, far]
                for one, other in ((near, far), (far, near)):
                    threading.Thread(target=self._pass_on, args=[one, other], daemon=True).start()

    def _pass_on(self, one: socket.socket, other: socket.socket) -> None:
        with contextlib.suppress(OSError):
            while data := one.recv(65536):
                other.sendall(data)
            other.shutdown(socket.SHUT_WR)


def take_until(inbox, done, patience_s: float = 30.0) -> list:
    """All that comes until `done(all of it)`."""
    got = []
    while not done(got):
        batch = inbox.take(patience_s)
        assert batch or done(got), f"nothing comes; so far {len(got)}; {inbox.tallies} {inbox.last_error}"
        got += batch
    return got


def to_rows(observations, scene) -> list[dict[str, float | None]]:
    """Rows of cells as a pilot makes them."""
    rows = []
    for n, t_s in enumerate(observations.t_s):
        row = {"t_s": float(t_s)} | dict(zip(ODOMETRY, map(float, observations.odometry[n]), strict=True))
        for tip, whisker in enumerate(scene.robot.of_role("texture")):
            for k, texture in enumerate(scene.arena.textures):
                value = float(observations.texture[n, tip, k])
                row[f"{whisker.name}_{texture}"] = None if math.isnan(value) else value
        for ray, whisker in enumerate(scene.robot.of_role("object")):
            value = float(observations.radial_m[n, ray])
            row[f"{whisker.name}_mm"] = None if math.isinf(value) else value * 1000.0
        rows.append(row)
    return rows
