"""Messages from CDR, by rosbags, and judged: a message is whole and possible, or is refused.

rosbags' decoder has no limits, and reads truth values of 2 and bytes that no encoder writes. So each number, text and
sequence is held against the table of ranges, and the bytes must be what encoding the message gives.
"""

import math
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from rosbags.interfaces import Nodetype
from rosbags.serde import SerdeError
from rosbags.typesys.store import Typestore

from ...recording.cdr import HEADER, Malformed
from .ranges import RANGES, Range

TEXT = "string"
ONE, MANY = -1, 0  # of Field.count; other values are the length of a fixed array


@dataclass(frozen=True)
class Field:
    """`kind`: a number's name in .msg files, TEXT, or "package/msg/Type"."""

    name: str
    kind: str
    count: int
    limits: Range

    @property
    def is_message(self) -> bool:
        return "/" in self.kind


class OutOfRange(Malformed):
    """A value that is read well and cannot be."""


@cache
def fields_of(store: Typestore, schema: str) -> tuple[Field, ...]:
    """The fields of "package/msg/Type" in the order of its file."""
    return tuple(_field(schema, name, *description) for name, description in store.fielddefs[schema][1])


def _field(schema: str, name: str, node: Nodetype, detail) -> Field:
    count = ONE
    if node in (Nodetype.ARRAY, Nodetype.SEQUENCE):
        (node, detail), length = detail
        count = length or MANY
    return Field(name, detail if node is Nodetype.NAME else detail[0], count, RANGES[f"{schema}:{name}"])


def decode(store: Typestore, data: bytes, schema: str) -> Any:
    """The message; OutOfRange names the field that cannot be, Malformed says why the bytes are no such message."""
    if data[: len(HEADER)] != HEADER:
        raise Malformed("not little-endian CDR")
    try:
        message = store.deserialize_cdr(data, schema)
    except SerdeError as error:
        raise Malformed(f"not the bytes of a {schema} ({error})") from None
    _judge(store, message, schema, "")
    again = store.serialize_cdr(message, schema, little_endian=True)
    if len(again) != len(data):
        raise Malformed(f"{len(data) - len(again)} bytes too many")
    if again != data:
        at = next(n for n, (ours, theirs) in enumerate(zip(again, data, strict=True)) if ours != theirs)
        raise Malformed(f"byte {at} is {data[at]}, which no encoder writes")
    return message


def _judge(store: Typestore, message: Any, schema: str, path: str) -> None:
    """OutOfRange for the first field that cannot be. Arrays become the message's own: they outlive the bytes."""
    for field in fields_of(store, schema):
        value, limits = getattr(message, field.name), field.limits
        try:
            if field.count == MANY and len(value) > limits.count:
                raise OutOfRange(f"{len(value)} elements, {limits.count} are the most")
            if field.is_message:
                for inner in [value] if field.count == ONE else value:
                    _judge(store, inner, field.kind, f"{path}{field.name}.")
            elif field.kind == TEXT:
                longest = len(value) if field.count == ONE else max(map(len, value), default=0)
                if longest > limits.high:
                    raise OutOfRange(f"{longest} characters, {limits.high} are the most")
            elif field.count == ONE:
                # Most numbers come one by one, where NumPy costs most.
                if not (math.isfinite(value) and limits.low <= value <= limits.high):
                    _check_numbers(np.array([value]), limits)
            else:
                _check_numbers(value, limits)
                setattr(message, field.name, value.copy())
        except OutOfRange as error:
            reported = str(error)
            raise (
                error if reported.startswith("field ") else OutOfRange(f"field {path}{field.name}: {reported}")
            ) from None


def _check_numbers(values: np.ndarray, limits: Range) -> None:
    """OutOfRange for the first number that is not allowed."""
    finite = np.isfinite(values)
    if limits.finite and not finite.all():
        raise OutOfRange("a number that is not finite")
    bad = finite & ((values < limits.low) | (values > limits.high))
    if bad.any():
        at = np.flatnonzero(bad)[0]
        low, high = (np.broadcast_to(limit, values.shape)[at] for limit in (limits.low, limits.high))
        raise OutOfRange(f"{values[at]:.6g} is not within {low:.6g} and {high:.6g}")
