"""A base of ROS 2 for tests: scripted, with types of its own (rosdesk), and the driver `whisker base` on it."""

import contextlib
import os
import signal
import subprocess
import sys
import threading
import time
import uuid
from itertools import count
from pathlib import Path

from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import array, float64
from patience import PATIENCE_S
from rosdesk import Desk, Header, Point, Pose, PoseWithCovariance, Quaternion, Time, Vector3, apart, message, wait_for

from crunchbot.pilot.base import Base, BaseError, BaseLost

VARIABLE = "CYCLONEDDS_URI"
ROBOT = """\
body_radius_m = 0.165
odometry_relative_sigma = 0.05
radial_sigma_m = 0.005

[base]
wheel_base_m = 0.25
wheel_most_m_s = 0.5

[base.ros2]
"""
SIGNED = 'signed_by = "the tests"\n'
STILL = (0.0, 0.0)
DOMAINS = count(100)  # one for each base

Twist = message("geometry_msgs/Twist", linear=Vector3, angular=Vector3)
TwistStamped = message("geometry_msgs/TwistStamped", header=Header, twist=Twist)
TwistWithCovariance = message("geometry_msgs/TwistWithCovariance", twist=Twist, covariance=array[float64, 36])
Odometry = message(
    "nav_msgs/Odometry", header=Header, child_frame_id=str, pose=PoseWithCovariance, twist=TwistWithCovariance
)
Bool = message("std_msgs/Bool", data=bool)


def scene_folder(folder: Path, more: str = "", signed: str | None = SIGNED) -> Path:
    folder.mkdir()
    (folder / "robot.toml").write_text(ROBOT + more)
    if signed is not None:
        (folder / "base_stops.toml").write_text(signed)
    return folder


class Peer:
    """Takes orders and says where it is, by a thread of its own. timeout_s: then it stops by itself; None: it drives on."""

    PERIOD_S = 0.02

    def __init__(self, kind: type[IdlStruct] = Twist, timeout_s: float | None = None):
        self.domain, self.tag = next(DOMAINS), str(uuid.uuid4())
        self._desk, self._timeout_s = Desk(self.tag, self.domain), timeout_s
        self.orders: list[tuple[float, float, float]] = []  # when it came, v, omega
        self.speaks, self.x = True, 0.0
        self._reader = self._desk.reader("rt/cmd_vel", kind)
        self._writer = self._desk.writer("rt/odom", Odometry)
        self._touches: dict = {}
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def close(self) -> None:
        self._over.set()
        self._thread.join()
        self._reader = self._writer = self._desk = None
        self._touches.clear()

    @property
    def variables(self) -> dict[str, str]:
        """The environment of a process that is to meet it."""
        return os.environ | {VARIABLE: apart(self.tag), "ROS_DOMAIN_ID": str(self.domain)}

    def touch(self, topic: str, is_touched: bool) -> None:
        if topic not in self._touches:
            self._touches[topic] = self._desk.writer(topic, Bool)
            wait_for(self._touches[topic].get_matched_subscriptions, f"nobody takes {topic}")
        self._touches[topic].write(Bool(is_touched))

    @property
    def order(self) -> tuple[float, float]:
        """The newest."""
        return self.orders[-1][1:] if self.orders else STILL

    def await_order(self, wanted: tuple[float, float], since: int = 0) -> float:
        """When an order of these speeds came, the first behind the first `since` orders."""

        def find():
            return next((at for at, *speeds in self.orders[since:] if tuple(speeds) == wanted), None)

        return wait_for(find, f"no order {wanted}")

    def await_silence(self, seconds: float) -> None:
        """Until no order has come for so long."""
        wait_for(lambda: self.orders and time.monotonic() - self.orders[-1][0] >= seconds, "it goes on ordering")

    def _run(self) -> None:
        last_s = time.monotonic()
        while not self._over.wait(self.PERIOD_S):
            now_s = time.monotonic()
            for sample in self._reader.take(100):
                if not sample.sample_info.valid_data:
                    continue
                twist = getattr(sample, "twist", sample)
                self.orders.append((now_s, twist.linear.x, twist.angular.z))
            timed_out = self._timeout_s is not None and self.orders and now_s - self.orders[-1][0] >= self._timeout_s
            v = 0.0 if timed_out else self.order[0]
            self.x, last_s = self.x + v * (now_s - last_s), now_s
            if self.speaks:
                self._writer.write(self._message(now_s, v))

    def _message(self, now_s: float, v: float) -> Odometry:
        stamp = Time(int(now_s), int(now_s % 1 * 1e9))
        pose = Pose(Point(self.x, 0.0, 0.0), Quaternion(0.0, 0.0, 0.0, 1.0))
        twist = Twist(Vector3(v, 0.0, 0.0), Vector3(0.0, 0.0, 0.0))
        with_covariance = TwistWithCovariance(twist, [0.0] * 36)
        return Odometry(Header(stamp, "odom"), "base_link", PoseWithCovariance(pose, [0.0] * 36), with_covariance)


class Running:
    """`whisker base` on a scene. heart: a pipe of a supervisor, on which `beat` writes."""

    def __init__(self, scene: Path, base: Peer, socket: Path, heart: bool = False):
        self.socket, reading, self._heart = socket, -1, -1
        words = [sys.executable, "-m", "crunchbot.cli", "base", str(scene), "--socket", str(socket)]
        environment = base.variables
        if heart:
            reading, self._heart = os.pipe()
            environment["WHISKER_HEARTBEAT_FD"] = str(reading)
        self.process = subprocess.Popen(
            words,
            stderr=subprocess.PIPE,
            text=True,
            env=environment,
            pass_fds=[reading] * heart,
            start_new_session=True,
        )
        if heart:
            os.close(reading)
        self._still = threading.Event()
        self._beating = threading.Thread(target=self._beat, daemon=True)
        self._beating.start()

    def _beat(self) -> None:
        with contextlib.suppress(BrokenPipeError):  # who is beaten for has been killed
            while self._heart >= 0 and not self._still.wait(0.05):
                os.write(self._heart, b".")

    def fall_silent(self) -> None:
        """The supervisor hangs."""
        self._still.set()
        self._beating.join()

    def leave(self) -> None:
        """The supervisor has died."""
        self.fall_silent()
        os.close(self._heart)
        self._heart = -1

    def client(self, held: tuple[str, ...] = ()) -> Base:
        """Connected as soon as there is a driver, one that is held by nothing else than this where that is given."""

        def connect():
            assert self.process.poll() is None, self.process.stderr.read()
            try:
                client = Base(str(self.socket), PATIENCE_S)
                if not held or client.health()["held"] in held:
                    return client
                client.close()
            except BaseLost:
                pass
            return None

        return wait_for(connect, "no driver")

    def ready(self) -> Base:
        """A client of a driver that would drive."""
        return self.client(("no",))

    @property
    def driver(self) -> int:
        with self.client() as client:
            return int(client.health()["driver_pid"])

    def close(self) -> str:
        """Its last words."""
        self._still.set()
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGCONT)
            self.process.terminate()
        words = self.process.communicate(timeout=PATIENCE_S)[1] if not self.process.stderr.closed else ""
        if self._heart >= 0:
            os.close(self._heart)
        return words


class Driving(threading.Thread):
    """A commander that orders again and again, on whatever driver there is, until closed."""

    def __init__(self, running: Running, v: float = 0.2):
        super().__init__(daemon=True)
        self._running, self._v, self._over = running, v, threading.Event()
        self.start()

    def run(self) -> None:
        base = None
        while not self._over.wait(0.05):
            try:
                base = base or Base(str(self._running.socket), 1.0)
                base.drive(self._v, 0.0)
            except BaseError:
                base = base and base.close()
        if base:
            base.close()

    def close(self) -> None:
        self._over.set()
        self.join()
