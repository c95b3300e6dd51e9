"""Any message of whisker/msgs to CDR and back, by what its .msg file says. Strict: a message is whole or is refused."""

from dataclasses import dataclass
from functools import cache

import numpy as np

from ..recording.cdr import Decoder, Encoder, Malformed
from ..recording.messages import SEPARATOR, definition

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


@dataclass(frozen=True)
class Codec:
    """Makes objects of bytes. types: class by schema; may_be_nan: paths (schema:field.field) of what need not be finite."""

    types: dict[str, type]
    may_be_nan: frozenset[str] = frozenset()

    def decode(self, data: bytes, schema: str):
        """The message; Malformed names the field that is wrong."""
        decoder = Decoder(data)
        message = self._read(decoder, schema, f"{schema}:")
        decoder.done()
        return message

    def _read(self, data: Decoder, schema: str, path: str):
        values = {}
        for field in fields_of(schema):
            place = f"{path}{field.name}"
            try:
                values[field.name] = self._values(data, field, place)
            except Malformed as error:
                told = str(error)
                raise (
                    error if told.startswith("field ") else Malformed(f"field {place.split(':')[1]}: {told}")
                ) from None
        return self.types[schema](**values)

    def _values(self, data: Decoder, field: Field, place: str):
        """Numbers of a sequence or array come as a NumPy array, other elements as a list."""
        count = int(data.number("I")) if field.count == MANY else abs(field.count)
        if field.kind in PRIMITIVES:
            values = data.array(PRIMITIVES[field.kind], count)
            self._check(field, values, place)
            return _plain(field.kind, values[0]) if field.count == ONE else values
        inner = [data.text() if field.kind == TEXT else self._read(data, field.kind, f"{place}.") for _ in range(count)]
        return inner[0] if field.count == ONE else inner

    def _check(self, field: Field, values: np.ndarray, place: str) -> None:
        if field.kind.startswith("float") and place not in self.may_be_nan and not np.isfinite(values).all():
            raise Malformed("a number that is not finite")
        if field.kind == "bool" and (values > 1).any():
            raise Malformed("a truth value that is neither 0 nor 1")


def encode(schema: str, message) -> bytes:
    """CDR of an object with an attribute for each field of the schema."""
    out = Encoder()
    write(out, schema, message)
    return out.message()


def _plain(kind: str, value: np.generic):
    return bool(value) if kind == "bool" else value.item()
