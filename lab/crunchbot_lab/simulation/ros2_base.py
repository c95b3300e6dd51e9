"""A simulated base that speaks ROS 2: the emulated Create's physics behind /cmd_vel and /odom.

Its wheels are those of whisker-base on the emulator; this process is a program of ROS 2 between them and the wire, as the node of a
real base is. SIGUSR1: the odometry is set anew. SIGUSR2: no odometry for a while.
"""

import argparse
import math
import os
import signal
import sys
import time
from pathlib import Path

import numpy as np
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader

from crunchbot.base_table import COMMAND_TYPES, Topics
from crunchbot.ends import exit_code
from crunchbot.pilot import base as bits
from crunchbot.pilot.base import Base, BaseLost, Motion
from crunchbot.robot.network import messages as m
from crunchbot.robot.ros2 import LOCALHOST
from crunchbot.robot.ros2.rmw_cyclonedds import Carrier, participate, quality, topic_name, topic_of
from crunchbot.robot.standard.types import decode, encode, make
from crunchbot.scene import load_robot
from crunchbot.stamping import stamp_output
from crunchbot.stopping import stop_on_signals

TURN_S = 0.01
ORDER_S = 0.1  # between two orders to whisker-base, which wants one within 0.3 s
GAP_S = 1.0
COMES_S = 30.0  # for whisker-base to come
TOUCHED = {
    "bump_left": bits.BUMP_LEFT,
    "bump_right": bits.BUMP_RIGHT,
    "cliff_left": bits.CLIFF_LEFT | bits.CLIFF_FRONT_LEFT,
    "cliff_right": bits.CLIFF_RIGHT | bits.CLIFF_FRONT_RIGHT,
    "wheel_drop": bits.DROP_LEFT | bits.DROP_RIGHT | bits.DROP_CASTER,
}


class Odometer:
    """Motions summed up to a pose with its covariance."""

    def __init__(self):
        self.pose, self.covariance = np.zeros(3), np.zeros((3, 3))

    def add(self, motion: Motion) -> None:
        c, s = math.cos(self.pose[2]), math.sin(self.pose[2])
        moved = np.array([c * motion.x_m - s * motion.y_m, s * motion.x_m + c * motion.y_m, motion.theta_rad])
        turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        carry = np.array([[1.0, 0.0, -moved[1]], [0.0, 1.0, moved[0]], [0.0, 0.0, 1.0]])
        self.covariance = carry @ self.covariance @ carry.T + turn @ np.array(motion.covariance) @ turn.T
        self.pose += moved


class SimulatedBase:
    """timeout_s: without an order for so long it stops; None: it drives on."""

    def __init__(self, base: Base, topics: Topics, kind: str, domain: int, period_s: float, timeout_s: float | None):
        self._base, self._schema, self._period_s, self._timeout_s = (
            base,
            f"geometry_msgs/msg/{kind}",
            period_s,
            timeout_s,
        )
        self._domain, self._participant = participate(domain, LOCALHOST)
        topic = topic_of(self._participant, topic_name(topics.command), self._schema)
        self._orders = DataReader(self._participant, topic, quality(self._schema, False))
        self._odometry = self._writer(topics.odometry, "nav_msgs/msg/Odometry")
        self._touch = {name: self._writer(topic, "std_msgs/msg/Bool") for name, topic in topics.touch.items()}
        self._odometer = Odometer()
        self._order, self._heard_s, self._told_s = (0.0, 0.0), float("-inf"), float("-inf")
        self._silent_until_s, self._odometry_s = float("-inf"), time.monotonic()

    def turn(self) -> None:
        now_s = time.monotonic()
        is_new = self._take_orders(now_s)
        timeout = self._timeout_s is not None and now_s - self._heard_s >= self._timeout_s
        order = (0.0, 0.0) if timeout else self._order
        if is_new or now_s - self._told_s >= ORDER_S:
            self._told_s = now_s
            self._base.drive(*order)
        if now_s - self._odometry_s >= self._period_s:
            self._say(now_s)

    def set_anew(self, *_: object) -> None:
        self._odometer = Odometer()

    def fall_silent(self, *_: object) -> None:
        self._silent_until_s = time.monotonic() + GAP_S

    def _take_orders(self, now_s: float) -> bool:
        """Whether another has come than the one before."""
        before = self._order
        for sample in self._orders.take(64):
            if sample.sample_info.valid_data:
                message = decode(self._schema, sample.cdr)
                twist = getattr(message, "twist", message)
                self._order, self._heard_s = (twist.linear.x, twist.angular.z), now_s
        return self._order != before

    def _say(self, now_s: float) -> None:
        motion, elapsed_s = self._base.odometry(), now_s - self._odometry_s
        self._odometry_s = now_s
        self._odometer.add(motion)
        if now_s >= self._silent_until_s:
            pose = m.PoseWithCovariance.planar(self._odometer.pose.tolist(), self._odometer.covariance)
            speeds = (motion.x_m / elapsed_s, 0.0, motion.theta_rad / elapsed_s)
            header = m.Header.at(time.time_ns(), "odom")
            twist = m.TwistWithCovariance.planar(speeds, np.zeros((3, 3)))
            self._odometry.write(Carrier(encode(m.Odometry(header, "base_link", pose, twist))))
        for name, writer in self._touch.items():
            writer.write(Carrier(encode(make("std_msgs/Bool", data=bool(motion.bits & TOUCHED[name])))))

    def _writer(self, topic: str, schema: str) -> DataWriter:
        return DataWriter(
            self._participant, topic_of(self._participant, topic_name(topic), schema), quality(schema, False)
        )


def main(words: list[str]) -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scene", type=Path, help="whose robot.toml names the topics")
    parser.add_argument("--base", required=True, help="socket of whisker-base")
    parser.add_argument("--domain", type=int, default=int(os.environ.get("ROS_DOMAIN_ID") or 0))
    parser.add_argument("--command-type", choices=COMMAND_TYPES, default=COMMAND_TYPES[0])
    parser.add_argument("--rate", type=float, default=62.0, help="of the odometry, Hz")
    parser.add_argument("--timeout", type=float, default=0.5, help="s without an order, then it stops; 0: it drives on")
    given = parser.parse_args(words)
    stop, topics = stop_on_signals(), load_robot(given.scene).base.topics or Topics()
    with _connected(given.base) as base:
        made = SimulatedBase(base, topics, given.command_type, given.domain, 1.0 / given.rate, given.timeout or None)
        signal.signal(signal.SIGUSR1, made.set_anew)
        signal.signal(signal.SIGUSR2, made.fall_silent)
        print("simulated base: is up", flush=True)
        while not stop.is_set():
            made.turn()
            time.sleep(TURN_S)
    return 0


def _connected(path: str) -> Base:
    end_s = time.monotonic() + COMES_S
    while True:
        try:
            return Base(path)
        except BaseLost:
            if time.monotonic() >= end_s:
                raise
            time.sleep(ORDER_S)


if __name__ == "__main__":
    stamp_output()
    sys.exit(exit_code("simulated base", lambda: main(sys.argv[1:])))
