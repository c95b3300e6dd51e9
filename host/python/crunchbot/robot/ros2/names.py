"""What both have in common: the names of a node, of topics and types, and the hashes of types."""

import re

from rosbags.typesys.store import Typestore

from ...recording.types import store as own_types
from ..standard import types


def node_name(robot: str) -> str:
    return ros_name(f"crunchbot_{robot}")


def ros_name(topic: str) -> str:
    """A topic with what ROS does not allow replaced: letters, digits and underscore remain, and a digit leads nothing."""
    return re.sub(r"(?<=/)(?=\d)", "_", re.sub(r"[^\w/]", "_", topic, flags=re.ASCII))


def dds_name(schema: str) -> str:
    """Of "package/msg/Type", as DDS and rmw_zenoh name it."""
    package, _, kind = schema.split("/")
    return f"{package}::msg::dds_::{kind}_"


def hash_of(schema: str) -> str:
    """RIHS01 of REP 2016."""
    return types_with(schema).hash_rihs01(schema)


def types_with(schema: str) -> Typestore:
    """The project's types or ROS 2's: those that define "package/msg/Type"."""
    return own_types() if schema in own_types().fielddefs else types.store()
