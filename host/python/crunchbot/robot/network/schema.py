"""Any message of crunchbot/msgs from CDR, by its type. Strict: a message is whole and possible, or is refused by its field.

rosbags' own decoder is not used here. It names no field, it reads strings without a closing zero and truth values of 2, and it
knows no limits: what comes over a network is judged number by number (`ranges`).
"""

import math
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from rosbags.interfaces import Nodetype

from ...recording.cdr import Decoder, Malformed
from ...recording.types import DTYPES, store
from .ranges import Range

TEXT = "string"
# Kinds of numbers as the struct module has them.
CODES = dict(zip(("bool", "byte", "uint8", "int8", "int32", "uint32", "int64", "uint64"), "BBBbiIqQ", strict=True))
CODES |= {"float32": "f", "float64": "d"}
ONE, MANY = -1, 0  # of Field.count; other values are the length of a fixed array


@dataclass(frozen=True)
class Field:
    """`kind`: a key of DTYPES, TEXT, or "package/msg/Type"."""

    name: str
    kind: str
    count: int


@cache
def fields_of(schema: str) -> tuple[Field, ...]:
    """The fields of "package/msg/Type" in the order of its file."""
    return tuple(_field(name, *description) for name, description in store().fielddefs[schema][1])


def _field(name: str, node: Nodetype, detail) -> Field:
    if node in (Nodetype.ARRAY, Nodetype.SEQUENCE):
        (node, detail), length = detail
        return Field(name, _kind(node, detail), length or MANY)
    return Field(name, _kind(node, detail), ONE)


def _kind(node: Nodetype, detail) -> str:
    return detail if node is Nodetype.NAME else detail[0]


class OutOfRange(Malformed):
    """A value that is read well and cannot be."""


@dataclass(frozen=True)
class Codec:
    """Makes objects of bytes. types: class by schema; ranges: what is allowed, by "schema:field"."""

    types: dict[str, type]
    ranges: dict[str, Range]

    def decode(self, data: bytes, schema: str) -> Any:
        """The message; Malformed names the field that is wrong."""
        decoder = Decoder(data)
        message = self._read(decoder, schema, "")
        decoder.done()
        return message

    def _read(self, data: Decoder, schema: str, path: str):
        values = {}
        for field in fields_of(schema):
            place = f"{path}{field.name}"
            try:
                values[field.name] = self._values(data, field, self.ranges[f"{schema}:{field.name}"], place)
            except Malformed as error:
                reported = str(error)
                raise error if reported.startswith("field ") else type(error)(f"field {place}: {reported}") from None
        return self.types[schema](**values)

    def _values(self, data: Decoder, field: Field, limits: Range, place: str):
        """Numbers of a sequence or array come as a NumPy array, other elements as a list."""
        count = int(data.number("I")) if field.count == MANY else abs(field.count)
        if field.count == MANY and count > limits.count:
            raise OutOfRange(f"{count} elements, {limits.count} are the most")
        if field.kind in DTYPES:
            if field.count == ONE:
                return _plain(field.kind, _checked(data.number(CODES[field.kind]), limits))
            values = data.array(DTYPES[field.kind], count)
            _check_numbers(values, limits)
            return values
        inner = [self._element(data, field, limits, place) for _ in range(count)]
        return inner[0] if field.count == ONE else inner

    def _element(self, data: Decoder, field: Field, limits: Range, place: str):
        if field.kind != TEXT:
            return self._read(data, field.kind, f"{place}.")
        text = data.text()
        if len(text) > limits.high:
            raise OutOfRange(f"{len(text)} characters, {limits.high} are the most")
        return text


def _checked(value: float, limits: Range) -> float:
    """The number itself; OutOfRange when it is not allowed. Most numbers come one by one, where NumPy costs most."""
    if not (math.isfinite(value) and limits.low <= value <= limits.high):
        _check_numbers(np.array([value]), limits)
    return value


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


def _plain(kind: str, value: float):
    return bool(value) if kind == "bool" else value
