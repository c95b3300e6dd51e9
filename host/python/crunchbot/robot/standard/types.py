"""Standard messages of ROS 2 (Jazzy), made by name, and their encoding, definition and hash, by rosbags."""

from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_typestore
from rosbags.typesys.store import Typestore

EMPTY = {"string": "", "bool": False, "float32": 0.0, "float64": 0.0}
OCTETS = ("byte", "char")  # as NumPy names neither


@cache
def store() -> Typestore:
    return get_typestore(Stores.ROS2_JAZZY)


def make(kind: str, **fields: Any) -> SimpleNamespace:
    """A message "package/Type" with these fields; the others are empty. TypeError for a field that it does not have."""
    empty = _empty_fields(kind)
    if not fields.keys() <= empty.keys():
        raise TypeError(f"{kind} has no field {', '.join(sorted(fields.keys() - empty.keys()))}")
    return SimpleNamespace(**empty | fields)


def encode(message: SimpleNamespace) -> bytes:
    """Little-endian CDR."""
    return bytes(store().serialize_cdr(message, message.__kind__, little_endian=True))


def decode(kind: str, data: bytes) -> Any:
    """The message that CDR bytes hold."""
    return store().deserialize_cdr(data, _full(kind))


def definition(kind: str) -> str:
    """The .msg text with all that it uses, as MCAP's and Foxglove's ros2msg schemas want it."""
    return store().generate_msgdef(_full(kind), ros_version=2)[0]


def doubles(values: ArrayLike) -> np.ndarray:
    """Numbers as the encoder asks for them. ValueError: they are none."""
    return np.ascontiguousarray(values, np.float64)


def type_hash(kind: str) -> str:
    """RIHS01 of REP 2016."""
    return store().hash_rihs01(_full(kind))


@cache
def _empty_fields(kind: str) -> dict:
    """Shared by all messages of a kind: a field is replaced, never changed."""
    fields = {name: _empty(*of) for name, of in store().fielddefs[_full(kind)][1]}
    return {"__kind__": _full(kind)} | fields


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
