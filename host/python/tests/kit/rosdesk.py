"""A program of ROS 2 by Cyclone DDS: its own participant, with types and settings that share nothing with the robot's side."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from cyclonedds.builtin import BuiltinDataReader, BuiltinTopicDcpsParticipant, BuiltinTopicDcpsPublication
from cyclonedds.core import InstanceState, ReadCondition, SampleState, ViewState
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import array, bounded_str, float32, float64, int8, int32, sequence, uint8, uint32
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy, Qos
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from patience import PATIENCE_S

DOMAIN = 17


@dataclass
class Time(IdlStruct, typename="builtin_interfaces.msg.dds_.Time_"):
    sec: int32
    nanosec: uint32


@dataclass
class Header(IdlStruct, typename="std_msgs.msg.dds_.Header_"):
    stamp: Time
    frame_id: str


@dataclass
class Vector3(IdlStruct, typename="geometry_msgs.msg.dds_.Vector3_"):
    x: float64
    y: float64
    z: float64


@dataclass
class Point(IdlStruct, typename="geometry_msgs.msg.dds_.Point_"):
    x: float64
    y: float64
    z: float64


@dataclass
class Quaternion(IdlStruct, typename="geometry_msgs.msg.dds_.Quaternion_"):
    x: float64
    y: float64
    z: float64
    w: float64


@dataclass
class Pose(IdlStruct, typename="geometry_msgs.msg.dds_.Pose_"):
    position: Point
    orientation: Quaternion


@dataclass
class PoseWithCovariance(IdlStruct, typename="geometry_msgs.msg.dds_.PoseWithCovariance_"):
    pose: Pose
    covariance: array[float64, 36]


@dataclass
class PoseWithCovarianceStamped(IdlStruct, typename="geometry_msgs.msg.dds_.PoseWithCovarianceStamped_"):
    header: Header
    pose: PoseWithCovariance


@dataclass
class Transform(IdlStruct, typename="geometry_msgs.msg.dds_.Transform_"):
    translation: Vector3
    rotation: Quaternion


@dataclass
class TransformStamped(IdlStruct, typename="geometry_msgs.msg.dds_.TransformStamped_"):
    header: Header
    child_frame_id: str
    transform: Transform


@dataclass
class TFMessage(IdlStruct, typename="tf2_msgs.msg.dds_.TFMessage_"):
    transforms: sequence[TransformStamped]


@dataclass
class JointState(IdlStruct, typename="sensor_msgs.msg.dds_.JointState_"):
    header: Header
    name: sequence[str]
    position: sequence[float64]
    velocity: sequence[float64]
    effort: sequence[float64]


@dataclass
class MapMetaData(IdlStruct, typename="nav_msgs.msg.dds_.MapMetaData_"):
    map_load_time: Time
    resolution: float32
    width: uint32
    height: uint32
    origin: Pose


@dataclass
class OccupancyGrid(IdlStruct, typename="nav_msgs.msg.dds_.OccupancyGrid_"):
    header: Header
    info: MapMetaData
    data: sequence[int8]


@dataclass
class Gid(IdlStruct, typename="rmw_dds_common.msg.dds_.Gid_"):
    data: array[uint8, 16]


@dataclass
class NodeEntitiesInfo(IdlStruct, typename="rmw_dds_common.msg.dds_.NodeEntitiesInfo_"):
    node_namespace: bounded_str[256]
    node_name: bounded_str[256]
    reader_gid_seq: sequence[Gid]
    writer_gid_seq: sequence[Gid]


@dataclass
class ParticipantEntitiesInfo(IdlStruct, typename="rmw_dds_common.msg.dds_.ParticipantEntitiesInfo_"):
    gid: Gid
    node_entities_info_seq: sequence[NodeEntitiesInfo]


# As rmw_cyclonedds makes it for ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST.
CONFIGURATION = (
    "<CycloneDDS><Domain><General><AllowMulticast>false</AllowMulticast></General>"
    "<Discovery><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>32</MaxAutoParticipantIndex>"
    '<Peers><Peer address="localhost"/></Peers></Discovery></Domain></CycloneDDS>'
)
BLOCKED_NS = 10**8
VOLATILE = Qos(Policy.Reliability.Reliable(BLOCKED_NS), Policy.History.KeepLast(10), Policy.Durability.Volatile)
KEPT = Qos(Policy.Reliability.Reliable(BLOCKED_NS), Policy.History.KeepLast(1), Policy.Durability.TransientLocal)
ALIVE = SampleState.Any | ViewState.Any | InstanceState.Alive


def apart(tag: str) -> str:
    """A configuration that keeps the participants of one tag to themselves, and on loopback."""
    interface = '<General><Interfaces><NetworkInterface address="127.0.0.1"/></Interfaces></General>'
    return f"<CycloneDDS><Domain>{interface}<Discovery><Tag>{tag}</Tag></Discovery></Domain></CycloneDDS>"


def wait_for(find: Callable[[], Any], what: str) -> Any:
    """What `find` gives, as soon as it gives something."""
    end = time.monotonic() + PATIENCE_S
    while not (found := find()):
        assert time.monotonic() < end, what
        time.sleep(0.02)
    return found


class Desk:
    """A participant, and what it sees of the others."""

    def __init__(self, tag: str, domain: int = DOMAIN):
        """domain: a process can have each but once."""
        self._domain = Domain(domain, f"{CONFIGURATION},{apart(tag)}")
        self._participant = DomainParticipant(domain)
        self._participants = BuiltinDataReader(self._participant, BuiltinTopicDcpsParticipant)
        self._publications = BuiltinDataReader(self._participant, BuiltinTopicDcpsPublication)

    def reader(self, name: str, kind: type[IdlStruct], qos: Qos = VOLATILE) -> DataReader:
        return DataReader(self._participant, Topic(self._participant, name, kind), qos)

    def writer(self, name: str, kind: type[IdlStruct]) -> DataWriter:
        return DataWriter(self._participant, Topic(self._participant, name, kind), VOLATILE)

    def others(self) -> list:
        """The other participants that are there."""
        found = self._participants.read(100, ReadCondition(self._participants, ALIVE))
        return [one for one in found if one.key != self._participant.guid]

    def publications(self) -> dict:
        """The endpoints of other participants that publish, by topic."""
        found = self._publications.read(1000, ReadCondition(self._publications, ALIVE))
        return {one.topic_name: one for one in found if one.participant_key != self._participant.guid}
