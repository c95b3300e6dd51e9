"""The base on the wire, by Cyclone DDS: orders out, odometry and touches in, and what the graph says of who takes orders."""

import math
import time
from collections.abc import Iterator
from typing import Any

from cyclonedds.builtin import BuiltinDataReader, BuiltinTopicDcpsSubscription
from cyclonedds.core import DDSException, InstanceState, ReadCondition, SampleState, ViewState
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy, Qos
from cyclonedds.sub import DataReader

from ...base_table import COMMAND_TYPES, Topics
from ..network import messages as m
from ..network.ros import heading_of
from ..ros2.names import dds_name
from ..ros2.rmw_cyclonedds import Carrier, idl_type, participate, quality, topic_name, topic_of
from ..standard.types import decode, encode, make
from . import SILENCE_S
from .motion import Said

ODOMETRY, TOUCH = "nav_msgs/msg/Odometry", "std_msgs/msg/Bool"
RELIABLE = Policy.Reliability.Reliable(max_blocking_time=0)
TAKEN_MOST = 64  # at once
SEEN_MOST = 1000
ALIVE = SampleState.Any | ViewState.Any | InstanceState.Alive
NAMES = {dds_name(f"geometry_msgs/msg/{kind}"): kind for kind in COMMAND_TYPES}


class Orders:
    """The publisher of a base's orders, of the type that is subscribed to; where both are, of the setting's."""

    def __init__(self, topics: Topics, domain: int, reach: str):
        self.kind = ""  # Twist or TwistStamped; empty: nobody takes orders, or nobody said which
        self._topics = topics
        self._domain, self.participant = participate(domain, reach)
        self._seen = BuiltinDataReader(self.participant, BuiltinTopicDcpsSubscription)
        self._alive = ReadCondition(self._seen, ALIVE)
        self._writer: DataWriter | None = None
        for kind in COMMAND_TYPES:  # what is made at the first use takes long, and the first order may be a stop
            self._encoded(kind, 0.0, 0.0)
            quality(f"geometry_msgs/msg/{kind}", False), idl_type(f"geometry_msgs/msg/{kind}")

    def look(self) -> bool:
        """Whether somebody takes the orders."""
        name = topic_name(self._topics.command)
        found = {NAMES.get(one.type_name) for one in self._seen.read(SEEN_MOST, self._alive) if one.topic_name == name}
        kinds = found - {None}
        kind = kinds.pop() if len(kinds) == 1 else self._topics.command_type if kinds else ""
        if kind and kind != self.kind:
            schema = f"geometry_msgs/msg/{kind}"
            self._writer = None  # of the other type: it is deleted before there is another of its name
            topic = topic_of(self.participant, name, schema)
            self._writer = DataWriter(self.participant, topic, quality(schema, False))
        self.kind = kind
        return self.is_heard()

    def is_heard(self) -> bool:
        return bool(self.kind and self._writer and self._writer.get_matched_subscriptions())

    def send(self, v_m_s: float, omega_rad_s: float) -> bool:
        """False: nobody takes it."""
        if not self.is_heard():
            return False
        try:
            self._writer.write(Carrier(self._encoded(self.kind, v_m_s, omega_rad_s)))
        except DDSException as error:
            if error.code != DDSException.DDS_RETCODE_TIMEOUT:
                raise
            return False
        return True

    def _encoded(self, kind: str, v_m_s: float, omega_rad_s: float) -> bytes:
        twist = m.Twist(m.Vector3(v_m_s, 0.0, 0.0), m.Vector3(0.0, 0.0, omega_rad_s))
        if kind == "Twist":
            return encode(twist)
        header = m.Header.at(time.time_ns(), self._topics.frame)
        return encode(make("geometry_msgs/TwistStamped", header=header, twist=twist))


class Wire(Orders):
    """With what the base says. Of several publishers of odometry the first counts, until it is silent."""

    def __init__(self, topics: Topics, domain: int, reach: str):
        super().__init__(topics, domain, reach)
        self.refused = 0  # messages that are none
        self._odometry = self._reader(
            topics.odometry, ODOMETRY, Policy.Reliability.BestEffort
        )  # of publishers of either kind
        # Touches may be said once: reliably, where their publisher is so, too.
        either = (Policy.Reliability.BestEffort, RELIABLE)
        self._touch = [(name, self._reader(on, TOUCH, how)) for name, on in topics.touch.items() for how in either]
        self._newest: Said | None = None
        decode(ODOMETRY, encode(m.Odometry(m.Header(), "", m.PoseWithCovariance(), m.TwistWithCovariance())))

    def odometry(self) -> Iterator[Said]:
        """What has come. Without stamps it is of when it came."""
        for publisher, message in self._take(self._odometry, ODOMETRY):
            now_s, newest = time.monotonic(), self._newest
            if newest and publisher != newest.publisher and now_s - newest.arrived_s < SILENCE_S:
                continue
            place, twist = message.pose.pose.position, message.twist.twist
            heading, stamp_ns = heading_of(message.pose.pose.orientation), message.header.stamp.ns
            if heading is None or not math.isfinite(place.x + place.y):
                self.refused += 1
                continue
            pose, speeds = (place.x, place.y, heading), (twist.linear.x, twist.angular.z)
            stamp_s = stamp_ns / 1e9 if stamp_ns else now_s
            self._newest = Said(stamp_s, now_s, publisher, pose, speeds, message.pose.planar_covariance)
            yield self._newest

    def touches(self) -> Iterator[tuple[str, bool]]:
        """What was touched, or is no longer."""
        for name, reader in self._touch:
            for _, message in self._take(reader, TOUCH):
                yield name, bool(message.data)

    def _reader(self, topic: str, schema: str, reliability: Any) -> DataReader:
        qos = Qos(reliability, Policy.History.KeepLast(TAKEN_MOST), base=quality(schema, False))
        return DataReader(self.participant, topic_of(self.participant, topic_name(topic), schema), qos)

    def _take(self, reader: DataReader, schema: str) -> Iterator[tuple[int, Any]]:
        """Number of the publisher, and message."""
        for sample in reader.take(TAKEN_MOST):
            if not sample.sample_info.valid_data:
                continue
            try:
                message = decode(schema, sample.cdr)
            except Exception:  # whatever rosbags finds wrong with bytes that anybody may send
                self.refused += 1
                continue
            yield sample.sample_info.publication_handle, message
