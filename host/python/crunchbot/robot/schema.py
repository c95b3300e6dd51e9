"""Any message of crunchbot/msgs to CDR and back, by what its .msg file says. Strict: a message is whole or is refused."""

from dataclasses import dataclass
from functools import cache

import numpy as np

from ..recording.cdr import Decoder, Encoder, Malformed
from ..recording.messages import SEPARATOR, definition
from .ranges import Range

PRIMITIVES = {
    "bool": "u1",
    "byte": "u1",
    "uint8": "u1",
    "int32": "i4",
    "uint32": "u4",
    "int64": "i8",
    "uint64": "u8",
    "float32": "f4",
    "float64": "f8",
}
TEXT = "string"
ONE, MANY = -1, 0  # of Field.count; other values are the length of a fixed array


@dataclass(frozen=True)
class Field:
    """`kind`: a key of PRIMITIVES, TEXT, or "package/msg/Type"."""

    name: str
    kind: str
    count: int


@cache
def fields_of(schema: str) -> tuple[Field, ...]:
    """The fields of "package/msg/Type" in the order of its file."""
    package, _, name = schema.split("/")
    lines = definition(f"{package}/msg/{name}").partition(SEPARATOR)[0].splitlines()
    words = (line.partition("#")[0].split() for line in lines)
    return tuple(_field(word[0], word[1], package) for word in words if word and "=" not in word[1])


def _field(kind: str, name: str, package: str) -> Field:
    kind, bracket, length = kind.partition("[")
    count = ONE if not bracket else int(length.rstrip("]") or MANY)
    if kind not in PRIMITIVES and kind != TEXT:
        owner, _, kind = kind.rpartition("/")
        kind = f"{owner or package}/msg/{kind}"
    return Field(name, kind, count)


def write(out: Encoder, schema: str, message) -> None:
    """Append the fields of `message`, an object with an attribute of each name."""
    for field in fields_of(schema):
        value = getattr(message, field.name)
        if field.count == MANY:
            out.number("I", len(value))
        elif field.count != ONE and len(value) != field.count:
            raise ValueError(f"{schema}: {field.name} has {len(value)} elements, {field.count} belong; mend the sender")
        _write_values(out, field, [value] if field.count == ONE else value)


def _write_values(out: Encoder, field: Field, values) -> None:
    if field.kind in PRIMITIVES:
        out.array(PRIMITIVES[field.kind], values)
    else:
        for value in values:
            out.text(value) if field.kind == TEXT else write(out, field.kind, value)


class OutOfRange(Malformed):
    """A value that is read well and cannot be."""


@dataclass(frozen=True)
class Codec:
    """Makes objects of bytes. types: class by schema; ranges: what is allowed, by "schema:field"."""

    types: dict[str, type]
    ranges: dict[str, Range]

    def decode(self, data: bytes, schema: str):
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
        if field.kind in PRIMITIVES:
            values = data.array(PRIMITIVES[field.kind], count)
            _check_numbers(values, limits)
            return _plain(field.kind, values[0]) if field.count == ONE else values
        inner = [self._element(data, field, limits, place) for _ in range(count)]
        return inner[0] if field.count == ONE else inner

    def _element(self, data: Decoder, field: Field, limits: Range, place: str):
        if field.kind != TEXT:
            return self._read(data, field.kind, f"{place}.")
        text = data.text()
        if len(text) > limits.high:
            raise OutOfRange(f"{len(text)} characters, {limits.high} are the most")
        return text


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


def encode(schema: str, message) -> bytes:
    """CDR of an object with an attribute for each field of the schema."""
    out = Encoder()
    write(out, schema, message)
    return out.message()


def _plain(kind: str, value: np.generic):
    return bool(value) if kind == "bool" else value.item()
