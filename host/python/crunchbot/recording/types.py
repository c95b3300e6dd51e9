"""The types of all messages (crunchbot/msgs), by rosbags: their fields, their encoding as CDR, their hashes for ROS 2."""

from functools import cache
from importlib.resources import files
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


def make_store() -> Typestore:
    """Every type of crunchbot/msgs."""
    types = {}
    for package in files("crunchbot").joinpath("msgs").iterdir():
        for file in package.joinpath("msg").iterdir():
            types |= get_types_from_msg(file.read_text(), f"{package.name}/msg/{file.name.removesuffix('.msg')}")
    made = get_typestore(Stores.EMPTY)
    made.register(types)
    return made


store = cache(make_store)


def encode(schema: str, message: Any) -> bytes:
    """Little-endian CDR of an object with an attribute for each field of "package/msg/Type". ValueError when a fixed array has
    another length."""
    return bytes(store().serialize_cdr(prepare(store(), schema, message), schema, little_endian=True))


def prepare(types: Typestore, schema: str, message: Any) -> Any:
    """The same message, its numbers now arrays of their types, which rosbags asks for. ValueError as of `encode`."""
    for name, (node, detail) in types.fielddefs[schema][1]:
        value = getattr(message, name)
        if node is Nodetype.NAME:
            prepare(types, detail, value)
        elif node is not Nodetype.BASE:
            (inner, kind), length = detail
            if node is Nodetype.ARRAY and len(value) != length:
                raise ValueError(f"{schema}: {name} has {len(value)} elements, {length} belong; mend the sender")
            if inner is Nodetype.NAME:
                for item in value:
                    prepare(types, kind, item)
            elif kind[0] in DTYPES:
                setattr(message, name, np.ascontiguousarray(value, DTYPES[kind[0]]))
    return message
