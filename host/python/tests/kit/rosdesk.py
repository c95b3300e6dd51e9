"""A program of ROS 2 by Cyclone DDS: its own participant, with types and settings that share nothing with the robot's side."""

import time
from collections.abc import Callable
from typing import Any

from cyclonedds.builtin import BuiltinDataReader, BuiltinTopicDcpsParticipant, BuiltinTopicDcpsPublication
from cyclonedds.core import InstanceState, ReadCondition, SampleState, ViewState
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.idl import IdlStruct, make_idl_struct
from cyclonedds.idl.types import array, bounded_str, float32, float64, int8, int32, sequence, uint8, uint32
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy, Qos
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from patience import PATIENCE_S

DOMAIN = 17


def message(name: str, /, **fields: Any) -> type[IdlStruct]:
    """A type of ROS 2, "package/Type", as it is on the wire."""
    package, kind = name.split("/")
    return make_idl_struct(kind, f"{package}.msg.dds_.{kind}_", fields)


Time = message("builtin_interfaces/Time", sec=int32, nanosec=uint32)
Header = message("std_msgs/Header", stamp=Time, frame_id=str)
Vector3 = message("geometry_msgs/Vector3", x=float64, y=float64, z=float64)
Point = message("geometry_msgs/Point", x=float64, y=float64, z=float64)
Quaternion = message("geometry_msgs/Quaternion", x=float64, y=float64, z=float64, w=float64)
Pose = message("geometry_msgs/Pose", position=Point, orientation=Quaternion)
PoseWithCovariance = message("geometry_msgs/PoseWithCovariance", pose=Pose, covariance=array[float64, 36])
PoseWithCovarianceStamped = message("geometry_msgs/PoseWithCovarianceStamped", header=Header, pose=PoseWithCovariance)
Transform = message("geometry_msgs/Transform", translation=Vector3, rotation=Quaternion)
TransformStamped = message("geometry_msgs/TransformStamped", header=Header, child_frame_id=str, transform=Transform)
TFMessage = message("tf2_msgs/TFMessage", transforms=sequence[TransformStamped])
JointState = message(
    "sensor_msgs/JointState",
    header=Header,
    name=sequence[str],
    position=sequence[float64],
    velocity=sequence[float64],
    effort=sequence[float64],
)
MapMetaData = message(
    "nav_msgs/MapMetaData", map_load_time=Time, resolution=float32, width=uint32, height=uint32, origin=Pose
)
OccupancyGrid = message("nav_msgs/OccupancyGrid", header=Header, info=MapMetaData, data=sequence[int8])
Gid = message("rmw_dds_common/Gid", data=array[uint8, 16])
NodeEntitiesInfo = message(
    "rmw_dds_common/NodeEntitiesInfo",
    node_namespace=bounded_str[256],
    node_name=bounded_str[256],
    reader_gid_seq=sequence[Gid],
    writer_gid_seq=sequence[Gid],
)
ParticipantEntitiesInfo = message(
    "rmw_dds_common/ParticipantEntitiesInfo", gid=Gid, node_entities_info_seq=sequence[NodeEntitiesInfo]
)

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
