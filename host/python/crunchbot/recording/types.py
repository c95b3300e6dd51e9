"""The types of all messages (crunchbot/msgs), by rosbags: their fields, their encoding as CDR, their hashes for ROS 2."""

from functools import cache
from importlib.resources import files
from types import SimpleNamespace
from typing import Any

import numpy as np
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

DTYPES = {
    "bool": "u1",
    "byte": "u1",
    "uint8": "u1",
    "int8": "i1",
    "int32": "<i4",
    "uint32": "<u4",
    "int64": "<i8",
    "uint64": "<u8",
    "float32": "<f4",
    "float64": "<f8",
}


@cache
def store() -> Typestore:
    """Every type of crunchbot/msgs."""
    types = {}
    for package in files("crunchbot").joinpath("msgs").iterdir():
        for file in package.joinpath("msg").iterdir():
            types |= get_types_from_msg(file.read_text(), f"{package.name}/msg/{file.name.removesuffix('.msg')}")
    made = get_typestore(Stores.EMPTY)
    made.register(types)
    return made


def encode(schema: str, message: Any) -> bytes:
    """Little-endian CDR of an object with an attribute for each field of "package/msg/Type". ValueError when a fixed array has
    another length."""
    return bytes(store().serialize_cdr(_prepared(schema, message), schema, little_endian=True))


def _prepared(schema: str, message) -> SimpleNamespace:
    """The message with its numbers as arrays of their types, which rosbags asks for."""
    values = {}
    for name, (node, detail) in store().fielddefs[schema][1]:
        value = getattr(message, name)
        if node is Nodetype.NAME:
            value = _prepared(detail, value)
        elif node is not Nodetype.BASE:
            (inner, kind), length = detail
            if node is Nodetype.ARRAY and len(value) != length:
                raise ValueError(f"{schema}: {name} has {len(value)} elements, {length} belong; mend the sender")
            if inner is Nodetype.NAME:
                value = [_prepared(kind, item) for item in value]
            elif kind[0] in DTYPES:
                value = np.ascontiguousarray(value, DTYPES[kind[0]])
        values[name] = value
    return SimpleNamespace(**values)
