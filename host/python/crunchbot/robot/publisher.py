"""What the pilot publishes over zenoh: observation rows, odometry, joints, contacts, behaviour."""

import math

import numpy as np

from ..observation import Row
from ..pilot.behaviour import TICK_S
from ..pilot.pilot import Pilot
from .network import messages
from .network.link import Link
from .network.ros import BASE_FRAME, ODOMETRY_FRAME
from .network.rows import ROW_NS, RowPublisher, compose
from .policy import OwnMap
from .wheels import Report

TICK_NS = round(TICK_S * 1e9)
RAD_PER_COUNT = np.pi / 65536.0
MIDDLE = 32768.0  # counts of a sensor at rest
PARTS = {"tip": messages.TIP, "shaft": messages.SHAFT, None: messages.UNKNOWN}
TOPICS = ("odometry", "joints", "contact", "behaviour")


class Publisher:
    """Publishes what a pilot does; `block` after each of its blocks, `row` after each of its rows."""

    def __init__(self, link: Link, pilot: Pilot, taker: OwnMap | None = None):
        """`taker`: is to know of every row that is sent."""
        self._taker = taker
        self._pilot, self._streams = pilot, {topic: link.publish(topic) for topic in TOPICS}
        self._rows, self._stamp_ns, self._pose = RowPublisher(link), 0, np.zeros(3)
        self._reported_ns: int | None = None  # stamp of the odometry before
        self._contacts = {lane: (c.onset, c.release) for lane, c in pilot.contacts.items()}
        self._measured, self._state = len(pilot.whisks), None

    @property
    def rows(self) -> int:
        return self._rows.sent

    def block(self, last: int) -> None:
        """Contacts and behaviour as they are after the block that ends with tick `last`."""
        self._stamp_ns = (last + 1) * TICK_NS
        for lane, contact in self._pilot.contacts.items():
            if (contact.onset, contact.release) != self._contacts[lane]:
                self._contacts[lane] = (contact.onset, contact.release)
                self._report_contact(lane)
        for whisk in self._pilot.whisks[self._measured :]:
            self._report_measured(whisk)
        self._measured = len(self._pilot.whisks)
        self._report_behaviour()

    def row(self, row: Row, report: Report, samples: np.ndarray) -> None:
        """The row of the 0.1 s that end with the newest block, and the odometry and samples (lanes,) at its end."""
        self._rows.send(row)
        if self._taker:
            self._taker.row(row)
        self._send("odometry", self._odometry(report))
        self._send("joints", self._joints(samples))

    def end(self, reason: str = "") -> None:
        """The streams are over."""
        self._rows.end(reason)
        for stream in self._streams.values():
            stream.end(self._stamp_ns, reason)

    def _odometry(self, report: Report) -> messages.Odometry:
        since_s = 1e-9 * (ROW_NS if self._reported_ns is None else self._stamp_ns - self._reported_ns)
        self._reported_ns, self._pose = self._stamp_ns, compose(self._pose, report.motion)
        header = messages.Header.at(self._stamp_ns, ODOMETRY_FRAME)
        speeds, covariance = np.divide(report.motion, since_s), report.covariance / since_s**2
        pose = messages.PoseWithCovariance(messages.Pose.planar(*self._pose))
        return messages.Odometry(header, pose=pose, twist=messages.TwistWithCovariance.planar(speeds, covariance))

    def _joints(self, samples: np.ndarray) -> messages.JointState:
        names = [f"{name}/{axis}" for name in self._pilot.names.values() for axis in ("alpha", "beta")]
        angles = np.stack([samples["alpha"], samples["beta"]], axis=-1).astype(np.float64)
        angles[samples["status"] != 0] = np.nan
        header = messages.Header.at(self._stamp_ns, BASE_FRAME)
        return messages.JointState(header, names, ((angles - MIDDLE) * RAD_PER_COUNT).ravel())

    def _report_contact(self, lane: int) -> None:
        contact, name = self._pilot.contacts[lane], self._pilot.names[lane]
        release = 0 if contact.touching else contact.release
        self._send("contact", self._contact(name, contact.touching, contact.onset, release))

    def _report_measured(self, whisk: dict) -> None:
        reported = self._contact(whisk["whisker"], False, whisk["onset"], whisk["release"])
        reported.measured = whisk["distance_mm"] is not None
        if reported.measured:
            reported.radius_m, reported.sigma_m = 1e-3 * whisk["distance_mm"], 1e-3 * whisk["sigma_mm"]
        reported.part = PARTS[whisk["type"]]
        reported.shape = _shape(whisk["face"])
        self._send("contact", reported)

    def _contact(self, name: str, touching: bool, onset: int, release: int) -> messages.Contact:
        header = messages.Header.at(self._stamp_ns, BASE_FRAME)
        times = (messages.Time.of(max(0, tick) * TICK_NS) for tick in (onset, release))
        return messages.Contact(header, name, touching, *times)

    def _report_behaviour(self) -> None:
        behaviour = self._pilot.behaviour
        if behaviour.state is not self._state:
            self._state = behaviour.state
            since = messages.Time.of(behaviour.since * TICK_NS)
            header = messages.Header.at(self._stamp_ns, BASE_FRAME)
            self._send("behaviour", messages.Behaviour(header, behaviour.state.value, since, behaviour.reason))

    def _send(self, topic: str, message) -> None:
        self._streams[topic].send(message)


def _shape(face: float) -> int:
    """What was met, by its probability of a tip on a surface; nan: not known."""
    if math.isnan(face):
        return messages.UNKNOWN
    return messages.FACE if face > 0.5 else messages.CORNER
