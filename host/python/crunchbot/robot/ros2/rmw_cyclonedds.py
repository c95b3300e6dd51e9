"""A running robot as a node of ROS 2: its standard messages, and its own, as rmw_cyclonedds publishes them.

rmw_cyclonedds's sources say what it expects: topics rt/NAME, types package::msg::dds_::Type_, XCDR of version 1, a type's hash in the
user data of its endpoint, and a message on ros_discovery_info, which says what endpoints are whose node's. Cyclone DDS wants a type
of IDL for each topic: it is made of the definition that encodes the messages.
"""

import os
import sys
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
from cyclonedds.core import DDSException, Entity
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.idl import IdlStruct, make_idl_struct
from cyclonedds.idl import types as idl
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy, Qos
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from rosbags.interfaces import Nodetype

from ...errors import UserError
from ..standard.outlet import Outlet
from ..standard.types import encode, make
from ..standard.view import LATCHED, POSE_SCHEMA, POSE_TOPIC, StandardView
from . import LOCALHOST, SUBNET
from .names import dds_name, hash_of, node_name, ros_name, types_with

# As rmw_cyclonedds writes them for the same range, since both sides of a machine must agree on what finds them.
GENERAL = {LOCALHOST: "<General><AllowMulticast>false</AllowMulticast></General>", SUBNET: ""}
PEERS = {LOCALHOST: '<Peers><Peer address="localhost"/></Peers>', SUBNET: ""}
NUMBERED = "<ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>32</MaxAutoParticipantIndex>"
CONFIGURATION = "CYCLONEDDS_URI"
GRAPH_TOPIC, GRAPH_SCHEMA = "ros_discovery_info", "rmw_dds_common/msg/ParticipantEntitiesInfo"
DEPTH = {False: 10, True: 1}  # of the history, by whether a topic is kept for those who come late
BLOCKED_NS = 10**8  # a message that a slow reader holds up for longer is not sent
POSES_MOST = 16  # taken at once
NUMBERS = ("int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64", "float32", "float64")
BASE_TYPES = {
    "bool": bool,
    "byte": idl.byte,
    "char": idl.uint8,
    "string": str,
    **{name: getattr(idl, name) for name in NUMBERS},
}


class DdsError(UserError):
    """Cyclone DDS does not start; one line."""

    exit_code = 1


class Carrier:
    """CDR where Cyclone DDS expects a message that encodes and decodes itself."""

    def __init__(self, cdr: bytes):
        self.cdr = cdr

    def serialize(self, **_: Any) -> bytes:
        return self.cdr

    @classmethod
    def deserialize(cls, cdr: bytes, **_: Any) -> "Carrier":
        return cls(cdr)

    deserialize_key = deserialize


@cache
def idl_type(schema: str) -> type[IdlStruct]:
    """Of "package/msg/Type"."""
    fields = {name: _idl_of(*of) for name, of in types_with(schema).fielddefs[schema][1]}
    name = dds_name(schema)
    return make_idl_struct(name.rpartition(":")[2], name.replace("::", "."), fields, dataclassify=False)


def _idl_of(node: Nodetype, detail: Any) -> Any:
    if node is Nodetype.NAME:
        return idl_type(detail)
    if node is Nodetype.BASE:
        name, most = detail
        return idl.bounded_str[most] if most else BASE_TYPES[name]
    element, length = _idl_of(*detail[0]), detail[1]
    if node is Nodetype.ARRAY:
        return idl.array[element, length]
    return idl.sequence[element, length] if length else idl.sequence[element]


def quality(schema: str, is_kept: bool) -> Qos:
    """Of a topic's endpoints: reliable; `is_kept`: the last message is for those who come late, too."""
    history = Policy.History.KeepLast(DEPTH[is_kept])
    unlimited = {"max_samples": -1, "max_instances": -1, "max_samples_per_instance": -1}
    kept = (Policy.Durability.TransientLocal, Policy.DurabilityService(cleanup_delay=0, history=history, **unlimited))
    return Qos(
        Policy.Reliability.Reliable(max_blocking_time=BLOCKED_NS),
        history,
        *(kept if is_kept else (Policy.Durability.Volatile,)),
        Policy.WriterDataLifecycle(autodispose=False),
        Policy.DataRepresentation(use_cdrv0_representation=True),
        Policy.Userdata(f"typehash={hash_of(schema)};".encode()),
    )


def participate(domain: int, reach: str) -> tuple[Domain, DomainParticipant]:
    """Both are to be kept. DdsError: Cyclone DDS refuses its configuration, or finds no network."""
    try:
        return Domain(domain, _configuration(reach)), DomainParticipant(domain, Qos(Policy.Userdata(b"enclave=/;")))
    except DDSException:  # Cyclone DDS has printed why
        text = f"mend {CONFIGURATION}, or choose another --domain or --range"
        raise DdsError(f"Cyclone DDS does not start, for the reason above; {text}") from None


def topic_of(participant: DomainParticipant, name: str, schema: str) -> Topic:
    """Of messages that are given, and come, as CDR."""
    topic = Topic(participant, name, idl_type(schema))
    topic.data_type = Carrier
    return topic


class CycloneNode(Outlet):
    """The node crunchbot_<robot>. DdsError: Cyclone DDS refuses its configuration, or finds no network."""

    def __init__(self, view: StandardView, robot: str, domain: int, reach: str):
        super().__init__(view, robot)
        self.name = node_name(robot)
        self._domain, self._participant = participate(domain, reach)
        self._writers: dict[str, DataWriter] = {}
        self._graph = self._writer(GRAPH_TOPIC, GRAPH_SCHEMA, True)
        poses = topic_of(self._participant, topic_name(POSE_TOPIC), POSE_SCHEMA)
        self._poses = DataReader(self._participant, poses, quality(POSE_SCHEMA, False))
        self.open_all()

    def open(self, topic: str, schema: str) -> None:
        self._writers[topic] = self._writer(topic_name(topic), schema, topic in LATCHED)
        self._describe()

    def send(self, topic: str, data: Callable[[], bytes], wall_ns: int) -> bool:
        writer = self._writers[topic]
        if topic not in LATCHED and not writer.get_matched_subscriptions():
            return False
        try:
            writer.write(Carrier(data()))
        except DDSException as error:
            if error.code != DDSException.DDS_RETCODE_TIMEOUT:
                raise
            return False
        return True

    def look(self) -> None:
        for sample in self._poses.take(POSES_MOST):
            if sample.sample_info.valid_data:
                self.set_pose(lambda cdr=sample.cdr: cdr)

    def warn(self, text: str) -> None:
        print(f"whisker: {text}", file=sys.stderr, flush=True)

    def close(self) -> None:
        """Readers learn of it: what nobody refers to is deleted."""
        self._writers.clear()
        self._graph = self._poses = self._participant = self._domain = None

    def _writer(self, name: str, schema: str, is_kept: bool) -> DataWriter:
        return DataWriter(self._participant, topic_of(self._participant, name, schema), quality(schema, is_kept))

    def _describe(self) -> None:
        """Says which endpoints are this node's."""
        node = make(
            "rmw_dds_common/NodeEntitiesInfo",
            node_namespace="/",
            node_name=self.name,
            reader_gid_seq=[_gid(self._poses)],
            writer_gid_seq=[_gid(writer) for writer in self._writers.values()],
        )
        message = make(
            "rmw_dds_common/ParticipantEntitiesInfo", gid=_gid(self._participant), node_entities_info_seq=[node]
        )
        self._graph.write(Carrier(encode(message)))


def topic_name(topic: str) -> str:
    return f"rt{ros_name(topic)}"


def _gid(entity: Entity) -> Any:
    return make("rmw_dds_common/Gid", data=np.frombuffer(entity.get_guid().bytes, np.uint8))


def _configuration(reach: str) -> str:
    """What a person wrote comes last and counts."""
    discovery = f"<Discovery>{NUMBERED}{PEERS[reach]}</Discovery>"
    own = f"<CycloneDDS><Domain>{GENERAL[reach]}{discovery}</Domain></CycloneDDS>"
    return ",".join(filter(None, (own, os.environ.get(CONFIGURATION))))
