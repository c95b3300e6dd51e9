"""Standard messages of ROS 2 (Jazzy), made by name, and their encoding, definition and hash, by rosbags.

Those that the robot's processes use too are objects of the same classes (network.ros); the others are rosbags' own.
"""

from functools import cache
from typing import Any

import numpy as np
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_typestore
from rosbags.typesys.store import Typestore

from ...recording.types import prepare
from ..network.messages import SCHEMAS, TYPES

EMPTY = {"string": "", "bool": False, "float32": 0.0, "float64": 0.0}
OCTETS = ("byte", "char")  # as NumPy names neither


@cache
def store() -> Typestore:
    made = get_typestore(Stores.ROS2_JAZZY)
    made.types.update({schema: kind for schema, kind in TYPES.items() if schema in made.types})
    return made


def make(kind: str, **fields: Any) -> Any:
    """A message "package/Type" with these fields; the others are empty. TypeError for a field that it does not have."""
    empty = {} if _full(kind) in TYPES else _empty_fields(kind)
    return store().types[_full(kind)](**empty | fields)


def encode(message: Any) -> bytes:
    """Little-endian CDR."""
    schema = SCHEMAS.get(type(message)) or message.__msgtype__
    return bytes(store().serialize_cdr(prepare(store(), schema, message), schema, little_endian=True))


def decode(kind: str, data: bytes) -> Any:
    """The message that CDR bytes hold."""
    return store().deserialize_cdr(data, _full(kind))


def definition(kind: str) -> str:
    """The .msg text with all that it uses, as MCAP's and Foxglove's ros2msg schemas want it."""
    return store().generate_msgdef(_full(kind), ros_version=2)[0]


def type_hash(kind: str) -> str:
    """RIHS01 of REP 2016."""
    return store().hash_rihs01(_full(kind))


@cache
def _empty_fields(kind: str) -> dict:
    """Shared by all messages of a kind: a field is replaced, never changed."""
    return {name: _empty(*of) for name, of in store().fielddefs[_full(kind)][1]}


def _full(kind: str) -> str:
    return kind if "/msg/" in kind else kind.replace("/", "/msg/")


def _empty(node: Nodetype, detail):
    if node is Nodetype.BASE:
        return EMPTY.get(detail[0], 0)
    if node is Nodetype.NAME:
        return make(detail)
    (inner, kind), length = detail
    if inner is Nodetype.NAME or kind[0] == "string":
        return []
    return np.zeros(length, np.uint8 if kind[0] in OCTETS else np.dtype(kind[0]))
